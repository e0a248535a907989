// TrainingViews: which keyframes' measurements are kept to optimise by, and whose turn it is.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/rng.hpp"
#include "covsplat/mapping/gaussian_map.hpp"

namespace covsplat {

struct ScheduleConfig {
  int steps_new = 10;
  int steps_near = 10;
  int steps_old = 0;
  int steps_hurried = 3;
  int steps_per_visit = 10;
  int max_steps_per_view = 40;
  int final_steps = 0;
  double view_spacing_m = 1.0;
  double max_views_mb = 250.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("steps_new", c.steps_new, Range{0, 10000}, "optimiser steps on each new keyframe");
    v.Field(
        "steps_near", c.steps_near, Range{0, 10000}, "... then on one of the views nearest to it");
    v.Field("steps_old", c.steps_old, Range{0, 10000}, "... then on one of all views");
    v.Field("steps_hurried",
            c.steps_hurried,
            Range{0, 10000},
            "these on the newest instead of all that, while more keyframes wait (threaded only)");
    v.Field("steps_per_visit",
            c.steps_per_visit,
            Range{1, 1000},
            "steps on one view before idle time goes to another");
    v.Field(
        "max_steps_per_view",
        c.max_steps_per_view,
        Range{0, 1000000},
        "idle time goes to no view that has had so many: more would fit its measurements, noise "
        "and all, at the cost of the surface; 0: no limit");
    v.Field("final_steps",
            c.final_steps,
            Range{0, 10000000},
            "steps over all views when the recording has ended");
    v.Field("view_spacing_m",
            c.view_spacing_m,
            Range{0.0, 100.0},
            "views nearer than this to another one are forgotten: memory is bounded by the places "
            "that were seen, not by time");
    v.Field("max_views_mb",
            c.max_views_mb,
            Range{1.0, 1e6},
            "memory of all views; beyond it one is forgotten for each new one, so that the way "
            "stays covered, but more sparsely");
  }
};

/// What optimisation has done by a keyframe's measurements.
struct KeyframeTraining {
  std::int64_t steps = 0;
  double loss = std::numeric_limits<double>::infinity();  ///< of the last step; before any: this
};

/// Owner of the choice; the measurements themselves are the engine's. Keyframes are numbered as in
/// the map, which must outlive it.
class TrainingViews {
 public:
  /// `pixels`: of the sensor's image.
  TrainingViews(GaussianMap& map, std::size_t pixels, const ScheduleConfig& config);

  /// Makes the newest keyframe a view; older ones are forgotten where there are too many.
  void Add(int keyframe);
  /// One or more steps were taken on a keyframe's view.
  void Trained(int keyframe, int steps, double loss);
  /// There is nothing to optimise any more.
  void ForgetAll();

  bool Empty() const { return views_.empty(); }
  int Newest() const { return views_.back().keyframe; }
  int Random() { return views_[rng_.Below(views_.size())].keyframe; }
  /// One of those nearest to the newest.
  int RandomNear();
  /// The one with most to gain: of large loss, and with few steps until now. So the newest go first
  /// until they have had what others have; a view of twice the loss gets about twice the steps, and
  /// every view has its turn. Nothing if all have had as many steps as are good for them.
  std::optional<int> Neediest() const;

  /// Oldest first.
  std::vector<int> Keyframes() const;
  /// [keyframes], also of those whose views are forgotten.
  const std::vector<KeyframeTraining>& Training() const { return training_; }
  std::size_t Bytes() const { return views_.size() * bytes_per_view_; }

 private:
  struct View {
    int keyframe;
    double travelled_m;  ///< from the first keyframe to this one
  };

  double Distance(const View& a, const View& b) const;
  void Thin();
  void ForgetLeastMissed();

  GaussianMap& map_;
  const ScheduleConfig config_;
  const std::size_t bytes_per_view_;
  std::vector<View> views_;  ///< oldest first
  std::vector<KeyframeTraining> training_;
  Rng rng_{20250711};
};

}  // namespace covsplat
