#include "covsplat/core/nearest_points.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include <nanoflann.hpp>

namespace covsplat {
namespace {

constexpr std::size_t kLeafPoints = 16;
constexpr std::size_t kGrain = 4096;

/// How nanoflann sees the points.
struct Points {
  std::span<const Eigen::Vector3d> points;

  // NOLINTBEGIN(readability-identifier-naming)
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
  // NOLINTEND(readability-identifier-naming)
};

using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>,
                                                  Points,
                                                  3,
                                                  std::uint32_t>;

}  // namespace

struct NearestPoints::Tree {
  explicit Tree(std::span<const Eigen::Vector3d> all)
      : points{all}, index(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafPoints)) {}

  Points points;
  Index index;
};

NearestPoints::NearestPoints(std::span<const Eigen::Vector3d> points)
    : tree_(std::make_unique<const Tree>(points)) {}
NearestPoints::~NearestPoints() = default;
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;

double NearestPoints::DistanceFrom(const Eigen::Vector3d& point) const {
  std::uint32_t nearest = 0;
  double squared_m2 = 0.0;
  if (tree_->index.knnSearch(point.data(), 1, &nearest, &squared_m2) == 0) {
    return std::numeric_limits<double>::infinity();
  }
  return std::sqrt(squared_m2);
}

std::vector<float> NearestPoints::DistancesFrom(std::span<const Eigen::Vector3d> points,
                                                ThreadPool& pool) const {
  std::vector<float> distances(points.size());
  ParallelFor(pool, points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      distances[i] = static_cast<float>(DistanceFrom(points[i]));
    }
  });
  return distances;
}

}  // namespace covsplat
