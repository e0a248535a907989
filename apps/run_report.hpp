// From the results of a run to the data of its report.
#pragma once

#include <string>

#include "apps/run_results.hpp"

#include "covsplat/report/report.hpp"

namespace covsplat {

ReportData ReportOf(const SlamSystem& system,
                    const std::string& config_yaml,
                    const RunResults& results);

}  // namespace covsplat
