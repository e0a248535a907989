// The sections of a report, top to bottom; each is empty if there is nothing to show.
#pragma once

#include <string>

#include "covsplat/report/report.hpp"

namespace covsplat::internal {

std::string TilesSection(const ReportData& data);
std::string TrajectorySection(const ReportData& data);
std::string MapSection(const ReportData& data);
std::string HeldOutSection(const ReportData& data);
std::string TimingSection(const ReportData& data);
std::string TrainingSection(const ReportData& data);
std::string GrowthSection(const ReportData& data);
std::string EventsSection(const ReportData& data);
std::string DetailsSection(const ReportData& data);

/// Mean errors over the scans that have both; none if there is no such scan.
HeldOutScan MeanHeldOut(const std::vector<HeldOutScan>& scans);

/// A titled card; `intro` is plain text.
std::string Card(const std::string& title, const std::string& intro, const std::string& html);

}  // namespace covsplat::internal
