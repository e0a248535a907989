#include "covsplat/loops/density_image.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <Eigen/Geometry>
#include <opencv2/features2d.hpp>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

/// A local map of kilometres is a mistake, and its image would not fit into memory.
constexpr int kMaxPixels = 4096;
// ORB as MapClosures has it.
constexpr int kFeatures = 500;
constexpr int kPatch = 31;
constexpr int kFastThreshold = 35;
/// Landmarks with a twin that differs in no more bits say nothing.
constexpr int kTwinDistance = 35;
constexpr int kTrials = 200;

struct Pair {
  Eigen::Vector2d fresh;
  Eigen::Vector2d old;
};

/// Least squares (Kabsch in the plane): with complex numbers it is one division.
PlaneMotion Fit(std::span<const Pair> pairs) {
  Eigen::Vector2d fresh_mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d old_mean = Eigen::Vector2d::Zero();
  for (const Pair& pair : pairs) {
    fresh_mean += pair.fresh / static_cast<double>(pairs.size());
    old_mean += pair.old / static_cast<double>(pairs.size());
  }
  double along = 0.0;
  double across = 0.0;
  for (const Pair& pair : pairs) {
    const Eigen::Vector2d a = pair.fresh - fresh_mean;
    const Eigen::Vector2d b = pair.old - old_mean;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  PlaneMotion motion;
  motion.turn_rad = std::atan2(across, along);
  motion.translation_m = old_mean - Eigen::Rotation2Dd(motion.turn_rad) * fresh_mean;
  return motion;
}

std::vector<Pair> InliersOf(const PlaneMotion& motion,
                            std::span<const Pair> pairs,
                            double tolerance_m) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(motion.turn_rad).toRotationMatrix();
  std::vector<Pair> inliers;
  for (const Pair& pair : pairs) {
    const Eigen::Vector2d error = turn * pair.fresh + motion.translation_m - pair.old;
    if (error.squaredNorm() <= tolerance_m * tolerance_m) inliers.push_back(pair);
  }
  return inliers;
}

/// For each fresh landmark the old one that is most alike.
std::vector<Pair> PairsOf(std::span<const Landmark> fresh,
                          std::span<const Landmark> old,
                          int max_distance) {
  std::vector<Pair> pairs;
  for (const Landmark& landmark : fresh) {
    int nearest = max_distance + 1;
    const Landmark* match = nullptr;
    for (const Landmark& other : old) {
      const int distance = HammingDistance(landmark, other);
      if (distance >= nearest) continue;
      nearest = distance;
      match = &other;
    }
    if (match == nullptr) continue;
    pairs.push_back({landmark.position_m.cast<double>(), match->position_m.cast<double>()});
  }
  return pairs;
}

std::vector<Landmark> WithoutTwins(const std::vector<Landmark>& landmarks) {
  std::vector<Landmark> single;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    bool has_twin = false;
    for (std::size_t k = 0; k < landmarks.size() && !has_twin; ++k) {
      has_twin = k != i && HammingDistance(landmarks[i], landmarks[k]) <= kTwinDistance;
    }
    if (!has_twin) single.push_back(landmarks[i]);
  }
  return single;
}

}  // namespace

DensityImage DensityOf(std::span<const Eigen::Vector3f> points_ground,
                       double cell_m,
                       double min_share) {
  DensityImage image;
  image.cell_m = cell_m;
  if (points_ground.empty()) return image;
  const auto cell_of = [&](const Eigen::Vector3f& p) -> Eigen::Vector2i {
    return (p.head<2>() / static_cast<float>(cell_m)).array().floor().cast<int>();
  };
  Eigen::Vector2i low = cell_of(points_ground[0]);
  Eigen::Vector2i high = low;
  for (const Eigen::Vector3f& p : points_ground) {
    low = low.cwiseMin(cell_of(p));
    high = high.cwiseMax(cell_of(p));
  }
  const Eigen::Vector2i size = (high - low).array() + 1;
  if (size.maxCoeff() > kMaxPixels) return image;
  image.origin = low;
  Image<int> count(size.x(), size.y(), 0);
  int most = 0;
  for (const Eigen::Vector3f& p : points_ground) {
    const Eigen::Vector2i cell = cell_of(p) - low;
    most = std::max(most, ++count(cell.x(), cell.y()));
  }
  image.pixels = Image<std::uint8_t>(size.x(), size.y(), 0);
  for (std::size_t i = 0; i < count.Size(); ++i) {
    const double share = static_cast<double>(count.Pixels()[i]) / most;
    if (share > min_share) image.pixels.Pixels()[i] = static_cast<std::uint8_t>(255.0 * share);
  }
  return image;
}

std::vector<Landmark> LandmarksOf(const DensityImage& image) {
  if (image.pixels.Size() == 0) return {};
  // OpenCV takes no pointer to constant pixels.
  std::vector<std::uint8_t> pixels(image.pixels.Pixels().begin(), image.pixels.Pixels().end());
  const cv::Mat picture(image.pixels.Rows(), image.pixels.Columns(), CV_8UC1, pixels.data());
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(
      kFeatures, 1.0f, 1, kPatch, 0, 2, cv::ORB::HARRIS_SCORE, kPatch, kFastThreshold);
  std::vector<cv::KeyPoint> spots;
  cv::Mat descriptors;
  orb->detectAndCompute(picture, cv::noArray(), spots, descriptors);
  std::vector<Landmark> landmarks(spots.size());
  for (std::size_t i = 0; i < spots.size(); ++i) {
    // Rows of the picture are x.
    const Eigen::Vector2f cell(spots[i].pt.y + static_cast<float>(image.origin.x()) + 0.5f,
                               spots[i].pt.x + static_cast<float>(image.origin.y()) + 0.5f);
    landmarks[i].position_m = static_cast<float>(image.cell_m) * cell;
    std::memcpy(
        landmarks[i].bits.data(), descriptors.ptr(static_cast<int>(i)), sizeof(landmarks[i].bits));
  }
  return WithoutTwins(landmarks);
}

int HammingDistance(const Landmark& a, const Landmark& b) {
  int distance = 0;
  for (std::size_t k = 0; k < a.bits.size(); ++k) distance += std::popcount(a.bits[k] ^ b.bits[k]);
  return distance;
}

SE3 PlaneMotion::InSpace() const {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ())),
          {translation_m.x(), translation_m.y(), 0.0}};
}

PlaneMotion MatchLandmarks(std::span<const Landmark> fresh,
                           std::span<const Landmark> old,
                           int max_distance,
                           double tolerance_m) {
  const std::vector<Pair> pairs = PairsOf(fresh, old, max_distance);
  std::vector<Pair> best;
  if (pairs.size() < 2) return {};
  Rng rng(20240513);
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::array<Pair, 2> two = {pairs[rng.Below(pairs.size())],
                                     pairs[rng.Below(pairs.size())]};
    const double fresh_m = (two[0].fresh - two[1].fresh).norm();
    const double old_m = (two[0].old - two[1].old).norm();
    if (fresh_m < 2.0 * tolerance_m || std::abs(fresh_m - old_m) > 2.0 * tolerance_m) continue;
    std::vector<Pair> inliers = InliersOf(Fit(two), pairs, tolerance_m);
    if (inliers.size() > best.size()) best = std::move(inliers);
  }
  if (best.size() < 2) return {};
  PlaneMotion motion = Fit(best);
  motion.inliers = static_cast<int>(InliersOf(motion, pairs, tolerance_m).size());
  return motion;
}

}  // namespace covsplat
