// LoopCloser: knows when a place is seen again, and what that says of the keyframes' poses.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "covsplat/loops/density_image.hpp"
#include "covsplat/loops/loop_check.hpp"
#include "covsplat/loops/odometry_noise.hpp"
#include "covsplat/loops/pose_graph.hpp"
#include "covsplat/registration/degeneracy.hpp"

namespace covsplat {

struct LoopSearchConfig {
  double min_way_m = 30.0;
  double reach_m = 10.0;
  double drift_m = 0.3;
  double drift_percent = 0.5;
  double weak_drift_percent = 10.0;
  double place_spacing_m = 1.0;
  double place_turn_deg = 30.0;
  double new_way_m = 10.0;
  double old_way_m = 15.0;
  double agree_m = 0.1;
  double agree_deg = 1.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("min_way_m",
            c.min_way_m,
            Range{1.0, 1e5},
            "a place may be one seen before if the way between them is at least this long");
    v.Field("reach_m",
            c.reach_m,
            Range{0.1, 1000.0},
            "... and it is nearer than this, plus what may have drifted");
    v.Field("drift_m", c.drift_m, Range{0.0, 100.0}, "drift that is possible on any way");
    v.Field("drift_percent", c.drift_percent, Range{0.0, 100.0}, "... and in percent of the way");
    v.Field("weak_drift_percent",
            c.weak_drift_percent,
            Range{0.0, 100.0},
            "... where surfaces do not hold the sensor in every direction");
    v.Field("place_spacing_m",
            c.place_spacing_m,
            Range{0.0, 100.0},
            "keyframes nearer than this to the last place are not places of their own");
    v.Field("place_turn_deg",
            c.place_turn_deg,
            Range{0.0, 360.0},
            "... unless they are turned by more than this");
    v.Field("new_way_m",
            c.new_way_m,
            Range{0.1, 1000.0},
            "the new local map: places on this much of the way back");
    v.Field("old_way_m",
            c.old_way_m,
            Range{0.1, 1000.0},
            "the old one: places on this much of its way, back and forth");
    v.Field("agree_m",
            c.agree_m,
            Range{0.0, 100.0},
            "a loop counts when another one says the same up to this, plus the drift between them");
    v.Field("agree_deg", c.agree_deg, Range{0.0, 180.0}, "... and this");
  }
};

/// How places are known again by what they look like from above, however far odometry has drifted.
struct LoopLooksConfig {
  bool enabled = true;
  double way_m = 50.0;
  double spacing_m = 10.0;
  double cell_m = 0.5;
  double min_density = 0.05;
  int max_hamming = 50;
  double tolerance_m = 1.5;
  int min_inliers = 10;
  double drift_percent = 3.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("enabled", c.enabled, "know places by their looks, too, not by their poses alone");
    v.Field("way_m", c.way_m, Range{1.0, 1000.0}, "of so much of the way a density image is made");
    v.Field("spacing_m", c.spacing_m, Range{1.0, 1000.0}, "... every so much of it");
    v.Field("cell_m", c.cell_m, Range{0.05, 10.0}, "edge of its pixels");
    v.Field("min_density",
            c.min_density,
            Range{0.0, 1.0},
            "pixels with less than this share of the most points are empty");
    v.Field("max_hamming",
            c.max_hamming,
            Range{0, 256},
            "landmarks of two images are alike if they differ in no more bits");
    v.Field("tolerance_m",
            c.tolerance_m,
            Range{0.01, 100.0},
            "... and belong together if one motion brings them as near");
    v.Field("min_inliers",
            c.min_inliers,
            Range{2, 500},
            "two images are of the same place if so many landmarks belong together");
    v.Field(
        "drift_percent",
        c.drift_percent,
        Range{0.0, 100.0},
        "drift on the level that is possible, in percent of the way; of the height it is that of "
        "the search");
  }
};

struct LoopConfig {
  LoopSearchConfig search;
  LoopLooksConfig looks;
  LoopCheckConfig check;
  OdometryNoiseConfig odometry;
  PoseGraphConfig graph;
  double max_places_mb = 200.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("max_places_mb",
            c.max_places_mb,
            Range{1.0, 1e6},
            "memory of what was seen at all places; beyond it that of one is given up for each new "
            "one, so that the way stays covered, but more sparsely");
    v.Section("search", c.search, "where loops are looked for");
    v.Section("looks", c.looks, "what places look like from above");
    v.Section("check", c.check, "which pairs of places are loops");
    v.Section("odometry", c.odometry, "how sure the way between keyframes is");
    v.Section("graph", c.graph, "the pose graph");
  }
};

/// What the closer is told of a keyframe. They come in order, none is left out.
struct LoopKeyframe {
  SE3 T_odom_keyframe;  ///< by tracking alone: earlier keyframes never move in this frame
  PoseKnowledge knowledge = {};
  Place place;
};

/// What made a pair of places worth a look.
enum class LoopHint {
  kPose,   ///< they are as near as drift allows
  kLooks,  ///< they look alike from above
};

template <>
struct EnumNames<LoopHint> {
  static constexpr std::array<EnumName<LoopHint>, 2> kNames{
      {{LoopHint::kPose, "pose"}, {LoopHint::kLooks, "looks"}}};
};

/// A pair of places that was looked at.
struct LoopRecord {
  LoopHint hint = LoopHint::kPose;
  int old_keyframe = 0;
  int new_keyframe = 0;
  double way_m = 0.0;    ///< between them along the graph
  double drift_m = 0.0;  ///< that is possible on it
  double moved_m = 0.0;  ///< from where the graph had it
  LoopCheck check;
};

/// Synchronous; one owner. Keyframes are the graph's nodes and numbered alike.
class LoopCloser {
 public:
  LoopCloser(const LoopConfig& config, ThreadPool& pool) : config_(config), pool_(pool) {}

  /// Takes the next keyframe in and looks for a loop; true if poses of earlier keyframes changed.
  bool Add(LoopKeyframe keyframe);

  /// All loops that were accepted, beyond doubt, and odometry as sure as they say it is.
  PoseGraph Graph() const;
  const std::vector<SE3>& Poses() const { return graph_.T_map_node; }
  const std::vector<LoopRecord>& Loops() const { return loops_; }
  /// How many of them have this fate.
  std::int64_t Count(LoopFate fate) const;
  /// Memory of the places.
  std::size_t PlacesBytes() const { return places_bytes_; }
  /// Whether any was accepted.
  bool HasLoops() const {
    return graph_.edges.size() >= graph_.T_map_node.size() && !Poses().empty();
  }

 private:
  /// What lies between a keyframe and all others, by the way that drifts least.
  struct Ways {
    std::vector<double> drift_m;
    std::vector<double> way_m;
  };
  /// What an edge of the graph stands for.
  struct Link {
    int loop;  ///< which one; kOdometry for a step of the way
    double drift_m;
    double way_m;
  };

  /// What the way up to a place looks like from above.
  struct Section {
    std::size_t place;
    SE3 T_ground_place;
    std::vector<Landmark> landmarks;
  };
  struct Candidate {
    std::size_t place;  ///< the old one
    LoopHint hint;
    SE3 T_old_new;
    double reach_m;  ///< that it may be off by
  };

  void AddNode(const LoopKeyframe& keyframe);
  bool IsPlace(const SE3& T_map_keyframe) const;
  void AddPlace(Place place);
  void EmptyLeastMissed();
  Ways WaysFrom(int keyframe) const;
  bool Look(const std::optional<Candidate>& candidate, const Ways& ways);
  std::optional<Candidate> NearestPlace(const Ways& ways) const;
  std::optional<Candidate> MostAlike(const Ways& ways) const;
  void AddSection();
  Eigen::Vector3d Up() const;
  LocalMap Around(std::size_t place, double back_m, double forth_m) const;
  LoopRecord Check(const Candidate& candidate, const Ways& ways) const;
  bool IsTooFar(const Candidate& candidate, const LoopRecord& loop) const;
  const SE3& PoseOf(const Place& place) const {
    return Poses()[static_cast<std::size_t>(place.keyframe)];
  }
  bool Agree(const LoopRecord& a, const LoopRecord& b) const;
  bool Confirm(std::size_t loop);
  void Accept(std::size_t loop);
  bool Undo(const std::vector<double>& weight);
  double MaxScale() const { return config_.odometry.max_factor * config_.odometry.max_factor; }
  PoseGraph GraphWith(double odometry_scale, bool loops_are_doubtful) const;
  bool Solve();

  const LoopConfig config_;
  ThreadPool& pool_;
  PoseGraph graph_;          ///< odometry as sure as it can be
  std::vector<Link> links_;  ///< [edges]
  OdometryChain odometry_;
  std::deque<Place> places_;  ///< oldest first; places stay where they are in memory
  std::vector<double> way_to_place_m_;
  std::size_t places_bytes_ = 0;
  std::vector<Section> sections_;
  double way_since_section_m_ = 0.0;
  std::vector<LoopRecord> loops_;
};

}  // namespace covsplat
