// Stitching: surfaces that were passed twice tell to millimetres how the two passes lie.
#pragma once

#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/parallel.hpp"
#include "covsplat/loops/pose_graph.hpp"

namespace covsplat {

struct StitchConfig {
  bool enabled = true;
  int rounds = 5;
  double gate_m = 0.3;
  double max_angle_deg = 20.0;
  double sigma_m = 0.02;
  double pairs_per_measurement = 8.0;
  int min_pairs = 10;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field(
        "enabled", c.enabled, "in the end, refine passes of the same surfaces against each other");
    v.Field(
        "rounds", c.rounds, Range{1, 100}, "times that Gaussians are matched and poses solved for");
    v.Field("gate_m",
            c.gate_m,
            Range{0.01, 10.0},
            "Gaussians of two passes may be one surface if they are as near");
    v.Field("max_angle_deg",
            c.max_angle_deg,
            Range{0.1, 90.0},
            "... and their normals differ by no more than this");
    v.Field("sigma_m",
            c.sigma_m,
            Range{1e-4, 1.0},
            "standard deviation of the distance between two such; far beyond it they do not count");
    v.Field("pairs_per_measurement",
            c.pairs_per_measurement,
            Range{1.0, 1e4},
            "neighbouring pairs err alike: so many count as one");
    v.Field("min_pairs",
            c.min_pairs,
            Range{1, 1000000},
            "two keyframes are tied if they have so many pairs in common");
  }
};

/// A flat piece of surface in the frame of the keyframe that it rides on; the normal faces who saw
/// it.
struct AnchoredSurfel {
  int keyframe = 0;
  Eigen::Vector3f mean;
  Eigen::Vector3f normal;
};

/// Point-to-plane matches between surfels of different passes, summed up for each pair of
/// keyframes: where the one would have to be as the other sees it, and how sure that is in every
/// direction. `way_m`: of every keyframe along the path; passes are two if `min_way_m` lies between
/// them.
std::vector<PoseEdge> StitchEdges(std::span<const AnchoredSurfel> surfels,
                                  std::span<const SE3> T_map_keyframe,
                                  std::span<const double> way_m,
                                  double min_way_m,
                                  const StitchConfig& config,
                                  ThreadPool& pool);

}  // namespace covsplat
