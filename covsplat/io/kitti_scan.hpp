// Scans as the KITTI data sets store them.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/result.hpp"
#include "covsplat/core/scan.hpp"

namespace covsplat {

/// Points and intensity of a file of float32 x y z intensity; stamp and times are left alone. An
/// empty file is a scan without points.
Result<Scan> ReadKittiScan(const std::filesystem::path& path);

/// One float32 per point: its time in seconds from the stamp of its scan.
Result<std::vector<float>> ReadPointTimes(const std::filesystem::path& path,
                                          std::size_t point_count);

/// Raises the elevation of every point, its range and azimuth kept: the published KITTI scans are
/// 0.2 deg low by their calibration.
void RaiseElevation(std::span<Eigen::Vector3f> points, double angle_rad);

}  // namespace covsplat
