// Patches: planes fitted to the measurements of several scans, as large as these allow. They become
// the map's Gaussians.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/mapping/point_grid.hpp"

namespace covsplat {

struct PatchConfig {
  bool enabled = true;
  double cell_m = 0.8;
  int levels = 3;
  double flatness_m = 0.015;
  int min_points = 6;
  double extent_factor = 1.2;
  double renew_factor = 4.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("enabled",
            c.enabled,
            "fit planes to all scans since the last keyframe; off: the keyframe's own pixels and "
            "covariances only (as in the paper; an ablation)");
    v.Field("cell_m", c.cell_m, Range{0.05, 10.0}, "edge of the largest cell that gets one patch");
    v.Field("levels",
            c.levels,
            Range{0, 4},
            "cells are halved so many times where their measurements are not flat");
    v.Field("flatness_m",
            c.flatness_m,
            Range{1e-4, 1.0},
            "a cell is flat if its plane leaves no more than this beside the measurements' noise");
    v.Field("min_points", c.min_points, Range{4, 10000}, "measurements that a patch needs");
    v.Field("extent_factor",
            c.extent_factor,
            Range{0.1, 5.0},
            "scale of a Gaussian in standard deviations of the measurements of its patch");
    v.Field("renew_factor",
            c.renew_factor,
            Range{1.0, 1e6},
            "Gaussians give way to patches with so many times more measurements per area");
  }
};

/// A flat Gaussian as far as it covers space, in the frame that the context names.
struct Disc {
  Eigen::Vector3f mean;
  Eigen::Vector3f u;  ///< axes times standard deviations, m
  Eigen::Vector3f v;
  float density = 0.0f;  ///< measurements per m2 that it was made of
};

/// A plane through measurements, in the frame of the last scan.
struct Patch {
  Eigen::Vector3f mean;
  Eigen::Matrix3f axes;     ///< columns: descending variance; the last faces who measured it
  Eigen::Vector3f sigma_m;  ///< standard deviations of the measurements along the axes
  float density;            ///< measurements per m2
  float intensity;          ///< mean of the measurements, 0 if scans have none
};

struct PatchFit {
  std::vector<Patch> patches;
  /// [points of the last scan] whether a new patch, or a disc that stays, passes where they are.
  std::vector<std::uint8_t> covered;
  std::vector<std::size_t> replaced;  ///< known discs that give way to patches, ascending
};

/// Sorts the measurements into cells that are aligned with the map, halves cells until each is flat
/// to within the noise that most cells show, and fits a plane to each, unless `known` discs (frame
/// of the last scan) cover most of its measurements and were made of about as many. Points that are
/// not finite or out of the sensor's range are left out. The same result for any number of threads.
PatchFit FitPatches(std::span<const PosedPoints> scans,
                    std::span<const Disc> known,
                    const SensorModel& sensor,
                    const PatchConfig& config,
                    ThreadPool& pool);

}  // namespace covsplat
