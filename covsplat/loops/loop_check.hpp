// Loop check: whether two local maps show the same place, and how they lie to each other.
#pragma once

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/parallel.hpp"
#include "covsplat/loops/local_map.hpp"

namespace covsplat {

struct LoopCheckConfig {
  double voxel_m = 0.5;
  double max_correspondence_m = 0.6;
  double inlier_distance_m = 0.15;
  double min_overlap = 0.5;
  double max_rms_m = 0.1;
  double max_seen_through = 0.22;
  double degeneracy_ratio = 0.01;
  double sigma_m = 0.02;
  double sigma_deg = 0.1;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field(
        "voxel_m", c.voxel_m, Range{0.05, 10.0}, "one point of a local map per cube of this size");
    v.Field("max_correspondence_m",
            c.max_correspondence_m,
            Range{0.05, 20.0},
            "in the end only points this near to each other are matched");
    v.Field("inlier_distance_m",
            c.inlier_distance_m,
            Range{0.01, 10.0},
            "matched points overlap when they are this near to each other's planes");
    v.Field("min_overlap",
            c.min_overlap,
            Range{0.0, 1.0},
            "a loop needs this share of the new local map to overlap with the old one");
    v.Field("max_rms_m",
            c.max_rms_m,
            Range{0.001, 10.0},
            "... with points no farther from each other's planes than this, root mean square");
    v.Field(
        "max_seen_through",
        c.max_seen_through,
        Range{0.0, 1.0},
        "... and no more than this share of either where the other one saw that there is nothing");
    v.Field("degeneracy_ratio",
            c.degeneracy_ratio,
            Range{0.0, 1.0},
            "... and surfaces that hold it along every direction with at least this share of the "
            "information that surfaces facing every way would give");
    v.Field("sigma_m",
            c.sigma_m,
            Range{0.0, 10.0},
            "standard deviation of a loop's position beside that of its registration");
    v.Field("sigma_deg", c.sigma_deg, Range{0.0, 90.0}, "... and of its rotation");
  }
};

/// Why a pair of places is a loop or is none.
enum class LoopFate {
  kAccepted,       ///< it is in the pose graph
  kAlone,          ///< passed every test, but no second loop confirms it (yet)
  kLittleOverlap,  ///< too little of the one lies on the other
  kPoorFit,        ///< what overlaps does not fit
  kSeenThrough,    ///< the one saw nothing where the other has surfaces
  kDegenerate,     ///< every other place along some direction would fit as well
  kTooFar,         ///< the drift cannot be as large as that
  kUndone,         ///< it was in the pose graph, which disagreed
};

template <>
struct EnumNames<LoopFate> {
  static constexpr std::array<EnumName<LoopFate>, 8> kNames{
      {{LoopFate::kAccepted, "accepted"},
       {LoopFate::kAlone, "alone"},
       {LoopFate::kLittleOverlap, "little overlap"},
       {LoopFate::kPoorFit, "poor fit"},
       {LoopFate::kSeenThrough, "seen through"},
       {LoopFate::kDegenerate, "degenerate"},
       {LoopFate::kTooFar, "too far"},
       {LoopFate::kUndone, "undone"}}};
};

struct LoopCheck {
  LoopFate fate = LoopFate::kLittleOverlap;  ///< kAlone if it passed
  SE3 T_old_new;
  /// Right perturbation [rad, m]; nothing is known in directions that the surfaces do not hold.
  Matrix6d information = Matrix6d::Zero();
  double overlap = 0.0;
  double rms_m = 0.0;
  double seen_through = 0.0;  ///< the larger share of the two
};

/// Registers the new local map to the old one, from a guess that may be off by `reach_m`, more and
/// more closely, and judges the outcome.
LoopCheck CheckLoop(const LocalMap& fresh,
                    const LocalMap& old,
                    const SE3& T_old_new_guess,
                    double reach_m,
                    const LoopCheckConfig& config,
                    ThreadPool& pool);

}  // namespace covsplat
