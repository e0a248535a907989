// Trajectories as comma-separated values, as the EuRoC and Newer College data sets have them.
#pragma once

#include <filesystem>

#include "covsplat/core/result.hpp"
#include "covsplat/core/trajectory.hpp"

namespace covsplat {

/// EuRoC: `stamp (whole nanoseconds), x, y, z, qw, qx, qy, qz`, any further columns are passed
/// over. Times must increase and quaternions be of unit length (to 1 %). One line of names may come
/// first. Errors name the line.
Result<Trajectory> ReadEurocCsv(const std::filesystem::path& path);

/// Newer College: `sec, nsec, x, y, z, qx, qy, qz, qw`; otherwise as above.
Result<Trajectory> ReadNewerCollegeCsv(const std::filesystem::path& path);

}  // namespace covsplat
