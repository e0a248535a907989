#include "covsplat/mapping/training_views.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "covsplat/core/check.hpp"
#include "covsplat/core/way_spread.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kNearViews = 8;
constexpr std::size_t kBytesPerPixel = 5;  // see splat/compact_view.hpp

}  // namespace

TrainingViews::TrainingViews(GaussianMap& map, std::size_t pixels, const ScheduleConfig& config)
    : map_(map), config_(config), bytes_per_view_(kBytesPerPixel * pixels) {}

double TrainingViews::Distance(const View& a, const View& b) const {
  return (map_.KeyframePose(a.keyframe).Translation() - map_.KeyframePose(b.keyframe).Translation())
      .norm();
}

void TrainingViews::Add(int keyframe) {
  COVSPLAT_CHECK(keyframe == static_cast<int>(training_.size()));
  training_.emplace_back();
  View view{keyframe, 0.0};
  if (!views_.empty()) {
    view.travelled_m = views_.back().travelled_m + Distance(views_.back(), view);
    Thin();
  }
  views_.push_back(view);
  if (static_cast<double>(Bytes()) > 1e6 * config_.max_views_mb) ForgetLeastMissed();
}

/// The newest view is to become an older one. Of those from about the same place the first of a
/// pass stays, and of several passes the last.
void TrainingViews::Thin() {
  constexpr double kSamePass = 3.0;  // in spacings of the way
  const double spacing_m = config_.view_spacing_m;
  const View newest = views_.back();
  views_.pop_back();
  const auto is_near = [&](const View& view) { return Distance(view, newest) < spacing_m; };
  const bool is_known = std::ranges::any_of(views_, [&](const View& view) {
    return is_near(view) && newest.travelled_m - view.travelled_m < kSamePass * spacing_m;
  });
  if (is_known) {
    map_.Engine().DropView(newest.keyframe);
    return;
  }
  std::erase_if(views_, [&](const View& view) {
    if (!is_near(view)) return false;
    map_.Engine().DropView(view.keyframe);
    return true;
  });
  views_.push_back(newest);
}

/// The newest views stay: tracking depends on what they improve.
void TrainingViews::ForgetLeastMissed() {
  std::vector<double> way_m;
  for (const View& view : views_) way_m.push_back(view.travelled_m);
  const std::optional<std::size_t> least = LeastMissed(way_m, kNearViews);
  if (!least) return;
  map_.Engine().DropView(views_[*least].keyframe);
  views_.erase(views_.begin() + static_cast<std::ptrdiff_t>(*least));
}

void TrainingViews::ForgetAll() {
  for (const View& view : views_) map_.Engine().DropView(view.keyframe);
  views_.clear();
}

void TrainingViews::Trained(int keyframe, int steps, double loss) {
  KeyframeTraining& training = training_[static_cast<std::size_t>(keyframe)];
  training.steps += steps;
  training.loss = loss;
}

int TrainingViews::RandomNear() {
  std::vector<std::pair<double, int>> by_distance;
  by_distance.reserve(views_.size());
  for (const View& view : views_) {
    by_distance.emplace_back(Distance(view, views_.back()), view.keyframe);
  }
  const std::size_t near = std::min(by_distance.size(), kNearViews);
  std::partial_sort(by_distance.begin(),
                    by_distance.begin() + static_cast<std::ptrdiff_t>(near),
                    by_distance.end());
  return by_distance[rng_.Below(near)].second;
}

std::optional<int> TrainingViews::Neediest() const {
  constexpr double kSoon = 10.0;  // steps in which much of what there is to gain is gained
  std::optional<int> neediest;
  double most = 0.0;
  for (const View& view : views_) {
    const KeyframeTraining& training = training_[static_cast<std::size_t>(view.keyframe)];
    if (config_.max_steps_per_view > 0 && training.steps >= config_.max_steps_per_view) continue;
    const double need = training.loss / (static_cast<double>(training.steps) + kSoon);
    if (neediest && !(need > most)) continue;
    neediest = view.keyframe;
    most = need;
  }
  return neediest;
}

std::vector<int> TrainingViews::Keyframes() const {
  std::vector<int> keyframes;
  for (const View& view : views_) keyframes.push_back(view.keyframe);
  return keyframes;
}

}  // namespace covsplat
