#include "covsplat/loops/loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <span>
#include <utility>

#include <Eigen/Cholesky>

#include "covsplat/core/way_spread.hpp"
#include "covsplat/loops/ground.hpp"

namespace covsplat {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kUnreached = std::numeric_limits<double>::infinity();
/// Loops that tell of the same revisit are no farther apart on either way.
constexpr double kSameRevisitM = 50.0;
/// With less weight than this a loop contradicts the rest of the graph.
constexpr double kUndoneWeight = 0.1;
constexpr int kOdometry = -1;

double AngleOf(const SE3& pose) { return pose.Log().head<3>().norm(); }

}  // namespace

bool LoopCloser::Add(LoopKeyframe keyframe) {
  AddNode(keyframe);
  if (!IsPlace(Poses().back())) return false;
  AddPlace(std::move(keyframe.place));
  const Ways ways = WaysFrom(places_.back().keyframe);
  bool found = Look(NearestPlace(ways), ways);
  if (config_.looks.enabled && way_since_section_m_ >= config_.looks.spacing_m) {
    AddSection();
    found = Look(MostAlike(ways), ways) || found;
  }
  return found && Solve();
}

/// Whether the candidate is a loop that others confirm.
bool LoopCloser::Look(const std::optional<Candidate>& candidate, const Ways& ways) {
  if (!candidate) return false;
  loops_.push_back(Check(*candidate, ways));
  return loops_.back().check.fate == LoopFate::kAlone && Confirm(loops_.size() - 1);
}

void LoopCloser::AddNode(const LoopKeyframe& keyframe) {
  if (graph_.T_map_node.empty()) {
    graph_.T_map_node.push_back(keyframe.T_odom_keyframe);
    odometry_.Append(keyframe.T_odom_keyframe, Matrix6d::Zero());
    return;
  }
  const int from = static_cast<int>(graph_.T_map_node.size()) - 1;
  const SE3 T_from_to = odometry_.PoseOf(from).Inverse() * keyframe.T_odom_keyframe;
  const double way_m = T_from_to.Translation().norm();
  const double percent = keyframe.knowledge.is_degenerate ? config_.search.weak_drift_percent
                                                          : config_.search.drift_percent;
  const Matrix6d covariance =
      StepCovariance(keyframe.knowledge.information, way_m, config_.odometry);
  odometry_.Append(keyframe.T_odom_keyframe, covariance);
  graph_.T_map_node.push_back(Poses().back() * T_from_to);
  graph_.edges.push_back(
      {from, from + 1, T_from_to, covariance.ldlt().solve(Matrix6d::Identity())});
  links_.push_back({kOdometry, 0.01 * percent * way_m, way_m});
}

bool LoopCloser::IsPlace(const SE3& T_map_keyframe) const {
  if (places_.empty()) return true;
  const SE3 moved = PoseOf(places_.back()).Inverse() * T_map_keyframe;
  return moved.Translation().norm() >= config_.search.place_spacing_m ||
         AngleOf(moved) >= config_.search.place_turn_deg * kDegree;
}

void LoopCloser::AddPlace(Place place) {
  double step_m = 0.0;
  if (!places_.empty()) {
    step_m = (PoseOf(place).Translation() - PoseOf(places_.back()).Translation()).norm();
  }
  way_since_section_m_ += step_m;
  way_to_place_m_.push_back((places_.empty() ? 0.0 : way_to_place_m_.back()) + step_m);
  places_bytes_ += place.Bytes();
  places_.push_back(std::move(place));
  if (static_cast<double>(places_bytes_) > 1e6 * config_.max_places_mb) EmptyLeastMissed();
}

/// A place without what was seen there adds nothing to local maps. The newest stay: density images
/// are made of them.
void LoopCloser::EmptyLeastMissed() {
  const double newest_m = std::max(config_.looks.way_m, config_.search.new_way_m);
  std::vector<std::size_t> full;
  std::vector<double> way_m;
  std::size_t newest = 0;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    if (places_[p].IsEmpty()) continue;
    full.push_back(p);
    way_m.push_back(way_to_place_m_[p]);
    newest += way_to_place_m_.back() - way_m.back() <= newest_m ? 1 : 0;
  }
  const std::optional<std::size_t> least = LeastMissed(way_m, newest);
  if (!least) return;
  Place& place = places_[full[*least]];
  places_bytes_ -= place.Bytes();
  place = {place.keyframe, {}, {}};
  places_bytes_ += place.Bytes();
}

/// Dijkstra's shortest paths.
LoopCloser::Ways LoopCloser::WaysFrom(int keyframe) const {
  std::vector<std::vector<std::size_t>> edges_at(Poses().size());
  for (std::size_t e = 0; e < links_.size(); ++e) {
    edges_at[static_cast<std::size_t>(graph_.edges[e].from)].push_back(e);
    edges_at[static_cast<std::size_t>(graph_.edges[e].to)].push_back(e);
  }
  Ways ways{std::vector<double>(Poses().size(), kUnreached), std::vector<double>(Poses().size())};
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  ways.drift_m[static_cast<std::size_t>(keyframe)] = 0.0;
  open.emplace(0.0, keyframe);
  while (!open.empty()) {
    const auto [drift_m, node] = open.top();
    open.pop();
    const auto here = static_cast<std::size_t>(node);
    if (drift_m > ways.drift_m[here]) continue;
    for (const std::size_t e : edges_at[here]) {
      const int other = graph_.edges[e].from + graph_.edges[e].to - node;
      const auto there = static_cast<std::size_t>(other);
      if (drift_m + links_[e].drift_m >= ways.drift_m[there]) continue;
      ways.drift_m[there] = drift_m + links_[e].drift_m;
      ways.way_m[there] = ways.way_m[here] + links_[e].way_m;
      open.emplace(ways.drift_m[there], other);
    }
  }
  return ways;
}

/// The nearest place that may be the newest one. One on the same floor, a room away, shows more of
/// the same than one right below.
std::optional<LoopCloser::Candidate> LoopCloser::NearestPlace(const Ways& ways) const {
  constexpr double kFarthestReachM = 6.0;
  constexpr double kHeightCounts = 4.0;
  const SE3& T_map_new = PoseOf(places_.back());
  const Eigen::Vector3d up = Up();
  std::optional<Candidate> nearest;
  double nearest_m = kUnreached;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const auto node = static_cast<std::size_t>(places_[p].keyframe);
    if (ways.way_m[node] < config_.search.min_way_m) continue;
    const SE3 T_old_new = PoseOf(places_[p]).Inverse() * T_map_new;
    if (T_old_new.Translation().norm() > config_.search.reach_m + ways.drift_m[node]) continue;
    const Eigen::Vector3d apart = PoseOf(places_[p]).Translation() - T_map_new.Translation();
    const double apart_m = (apart + (kHeightCounts - 1.0) * up.dot(apart) * up).norm();
    if (apart_m >= nearest_m) continue;
    const double drift_m = ways.drift_m[node] + config_.search.drift_m;
    nearest = {p, LoopHint::kPose, T_old_new, std::min(2.0 * drift_m, kFarthestReachM)};
    nearest_m = apart_m;
  }
  return nearest;
}

/// The section that has most landmarks in common with the newest one.
std::optional<LoopCloser::Candidate> LoopCloser::MostAlike(const Ways& ways) const {
  const Section& fresh = sections_.back();
  std::optional<Candidate> best;
  int most = config_.looks.min_inliers - 1;
  // Sections of one way that overlap are alike, of course.
  const double min_way_m = config_.search.min_way_m + config_.looks.way_m;
  for (const Section& old : std::span(sections_).first(sections_.size() - 1)) {
    const auto node = static_cast<std::size_t>(places_[old.place].keyframe);
    if (ways.way_m[node] < min_way_m) continue;
    const PlaneMotion motion = MatchLandmarks(
        fresh.landmarks, old.landmarks, config_.looks.max_hamming, config_.looks.tolerance_m);
    if (motion.inliers <= most) continue;
    most = motion.inliers;
    const SE3 T_old_new = old.T_ground_place.Inverse() * motion.InSpace() * fresh.T_ground_place;
    best = {old.place, LoopHint::kLooks, T_old_new, 2.0 * config_.looks.tolerance_m};
  }
  return best;
}

void LoopCloser::AddSection() {
  const std::size_t newest = places_.size() - 1;
  const LocalMap map = Around(newest, config_.looks.way_m, 0.0);
  std::vector<Eigen::Vector3f> points = PointsOf(map, config_.looks.cell_m);
  const SE3 T_ground_place = AlignWithGround(points);
  for (Eigen::Vector3f& p : points) p = (T_ground_place * p.cast<double>()).cast<float>();
  const DensityImage image = DensityOf(points, config_.looks.cell_m, config_.looks.min_density);
  sections_.push_back({newest, T_ground_place, LandmarksOf(image)});
  way_since_section_m_ = 0.0;
}

/// Off the ground of the newest section, in the map frame; zero before there is one.
Eigen::Vector3d LoopCloser::Up() const {
  if (sections_.empty()) return Eigen::Vector3d::Zero();
  const Section& section = sections_.back();
  const Eigen::Quaterniond ground_place = section.T_ground_place.Rotation();
  return PoseOf(places_[section.place]).Rotation() *
         (ground_place.inverse() * Eigen::Vector3d::UnitZ());
}

/// Places on the way before and after one, in its frame.
LocalMap LoopCloser::Around(std::size_t place, double back_m, double forth_m) const {
  const auto pose_of = [&](std::size_t p) -> const SE3& { return PoseOf(places_[p]); };
  const SE3 T_local_map = pose_of(place).Inverse();
  LocalMap map = {{&places_[place], SE3()}};
  const auto add = [&](std::size_t p, std::size_t neighbour, double& left_m) {
    left_m -= (pose_of(p).Translation() - pose_of(neighbour).Translation()).norm();
    if (left_m >= 0.0) map.push_back({&places_[p], T_local_map * pose_of(p)});
  };
  for (std::size_t p = place; p > 0 && back_m >= 0.0; --p) add(p - 1, p, back_m);
  for (std::size_t p = place + 1; p < places_.size() && forth_m >= 0.0; ++p) add(p, p - 1, forth_m);
  return map;
}

LoopRecord LoopCloser::Check(const Candidate& candidate, const Ways& ways) const {
  const LoopSearchConfig& search = config_.search;
  const Place& old = places_[candidate.place];
  const auto node = static_cast<std::size_t>(old.keyframe);
  LoopRecord loop;
  loop.hint = candidate.hint;
  loop.old_keyframe = old.keyframe;
  loop.new_keyframe = places_.back().keyframe;
  loop.way_m = ways.way_m[node];
  loop.drift_m = ways.drift_m[node] + search.drift_m;
  loop.check = CheckLoop(Around(places_.size() - 1, search.new_way_m, 0.0),
                         Around(candidate.place, search.old_way_m, search.old_way_m),
                         candidate.T_old_new,
                         candidate.reach_m,
                         config_.check,
                         pool_);
  const SE3 T_old_new = PoseOf(old).Inverse() * PoseOf(places_.back());
  loop.moved_m = (loop.check.T_old_new.Translation() - T_old_new.Translation()).norm();
  if (loop.check.fate == LoopFate::kAlone && IsTooFar(candidate, loop)) {
    loop.check.fate = LoopFate::kTooFar;
  }
  return loop;
}

/// Whether odometry would have to have drifted more than it can. Floors of a building look alike:
/// the height may be off by no more than that of a place found by its pose.
bool LoopCloser::IsTooFar(const Candidate& candidate, const LoopRecord& loop) const {
  if (candidate.hint == LoopHint::kPose) return loop.moved_m > loop.drift_m;
  const SE3& T_map_old = PoseOf(places_[candidate.place]);
  const Eigen::Vector3d moved =
      (T_map_old * loop.check.T_old_new).Translation() - PoseOf(places_.back()).Translation();
  const double far_m = config_.search.drift_m + 0.01 * config_.looks.drift_percent * loop.way_m;
  return std::abs(Up().dot(moved)) > loop.drift_m || moved.norm() > far_m;
}

/// Whether two loops say the same of the drift between the two ways.
bool LoopCloser::Agree(const LoopRecord& a, const LoopRecord& b) const {
  if (a.new_keyframe == b.new_keyframe) return false;
  const auto pose = [&](int k) -> const SE3& { return Poses()[static_cast<std::size_t>(k)]; };
  const SE3 old_way = pose(a.old_keyframe).Inverse() * pose(b.old_keyframe);
  const SE3 new_way = pose(b.new_keyframe).Inverse() * pose(a.new_keyframe);
  const double way_m = old_way.Translation().norm() + new_way.Translation().norm();
  if (way_m > 2.0 * kSameRevisitM) return false;
  const SE3 error = a.check.T_old_new.Inverse() * old_way * b.check.T_old_new * new_way;
  const double drift_m = 0.01 * config_.search.drift_percent * way_m;
  return error.Translation().norm() <= config_.search.agree_m + drift_m &&
         AngleOf(error) <= config_.search.agree_deg * kDegree;
}

/// Accepts a loop with all that say the same, if there are any.
bool LoopCloser::Confirm(std::size_t loop) {
  bool confirmed = false;
  for (std::size_t other = 0; other < loop; ++other) {
    const LoopFate fate = loops_[other].check.fate;
    if (fate != LoopFate::kAlone && fate != LoopFate::kAccepted) continue;
    if (!Agree(loops_[other], loops_[loop])) continue;
    if (fate == LoopFate::kAlone) Accept(other);
    confirmed = true;
  }
  if (confirmed) Accept(loop);
  return confirmed;
}

void LoopCloser::Accept(std::size_t loop) {
  LoopRecord& record = loops_[loop];
  record.check.fate = LoopFate::kAccepted;
  graph_.edges.push_back({record.old_keyframe,
                          record.new_keyframe,
                          record.check.T_old_new,
                          record.check.information,
                          true});
  links_.push_back({static_cast<int>(loop), config_.search.drift_m, 0.0});
}

/// Takes the loops that the rest of the graph contradicts out of it; false if there are none.
bool LoopCloser::Undo(const std::vector<double>& weight) {
  bool undone = false;
  for (std::size_t e = weight.size(); e-- > 0;) {
    if (links_[e].loop == kOdometry || weight[e] >= kUndoneWeight) continue;
    loops_[static_cast<std::size_t>(links_[e].loop)].check.fate = LoopFate::kUndone;
    const auto at = static_cast<std::ptrdiff_t>(e);
    graph_.edges.erase(graph_.edges.begin() + at);
    links_.erase(links_.begin() + at);
    undone = true;
  }
  return undone;
}

std::int64_t LoopCloser::Count(LoopFate fate) const {
  return std::ranges::count_if(loops_,
                               [&](const LoopRecord& loop) { return loop.check.fate == fate; });
}

PoseGraph LoopCloser::GraphWith(double odometry_scale, bool loops_are_doubtful) const {
  PoseGraph graph = graph_;
  for (std::size_t e = 0; e < links_.size(); ++e) {
    const bool is_loop = links_[e].loop != kOdometry;
    graph.edges[e].doubtful = is_loop && loops_are_doubtful;
    if (!is_loop) graph.edges[e].information /= odometry_scale;
  }
  return graph;
}

PoseGraph LoopCloser::Graph() const {
  std::vector<PoseEdge> loops;
  for (std::size_t e = 0; e < links_.size(); ++e) {
    if (links_[e].loop != kOdometry) loops.push_back(graph_.edges[e]);
  }
  return GraphWith(odometry_.ScaleBy(loops, MaxScale()), false);
}

/// Poses by all loops that agree; true if any pose changed. What contradicts the others is found
/// out with odometry that may have drifted a lot; what is left says how much it has.
bool LoopCloser::Solve() {
  constexpr double kNoChange = 1e-4;  // rad and m
  while (Undo(Optimize(GraphWith(MaxScale(), true), config_.graph).weight)) {
  }
  PoseGraphSolution solution = Optimize(Graph(), config_.graph);
  double change = 0.0;
  for (std::size_t k = 0; k < Poses().size(); ++k) {
    const Vector6d moved = (Poses()[k].Inverse() * solution.T_map_node[k]).Log();
    change = std::max(change, moved.lpNorm<Eigen::Infinity>());
  }
  graph_.T_map_node = std::move(solution.T_map_node);
  return change > kNoChange;
}

}  // namespace covsplat
