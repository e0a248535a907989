// The sensor model of a run: given in the configuration, or estimated from the first scans.
#pragma once

#include <filesystem>
#include <string>

#include "apps/app_config.hpp"

#include "covsplat/core/sensor_model.hpp"
#include "covsplat/io/scan_source.hpp"

namespace covsplat {

struct SensorChoice {
  SensorModel model;
  std::string verdict;  ///< where it comes from, for people
};

/// Fills what `config.sensor` leaves open from the first scans of a recording; with the filled
/// configuration the same model comes out again, whatever the scans.
Result<SensorChoice> ChooseSensor(const std::filesystem::path& recording,
                                  SourceOptions source,
                                  SlamConfig& config);

/// The model of a filled configuration, such as a run leaves in its folder.
Result<SensorModel> SensorOf(const SlamConfig& config);

/// The first scans that can be read and have points.
Result<std::vector<Scan>> FirstScans(const std::filesystem::path& recording,
                                     SourceOptions source,
                                     int count);

}  // namespace covsplat
