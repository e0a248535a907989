#include "bench/recorded_street.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <span>
#include <utility>

#include "tests/support/data.hpp"
#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <nanoflann.hpp>

#include "covsplat/core/rng.hpp"
#include "covsplat/io/kitti_scan.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

constexpr int kFirstScan = 54;
constexpr int kLastScan = 66;
constexpr int kScanStep = 3;
constexpr int kViewScan = 60;
constexpr float kMinRange = 2.5f;  // m; nearer returns are the car itself
constexpr float kMaxRange = 80.0f;
constexpr std::size_t kNormalNeighbours = 10;
constexpr std::size_t kSpacingNeighbours = 4;

SensorModel StreetSensor() {
  constexpr int kRows = 64;
  constexpr double kRadPerDeg = std::numbers::pi / 180.0;
  constexpr double kHalfRow = 0.5 * 26.8 / kRows;
  return UniformSensorModel(kRows,
                            1024,
                            (-24.8 + kHalfRow) * kRadPerDeg,
                            (2.0 - kHalfRow) * kRadPerDeg,
                            kMinRange,
                            kMaxRange);
}

/// Nothing if the file is not there or damaged.
std::vector<Eigen::Vector3f> ReadPoints(const fs::path& path) {
  Result<Scan> scan = ReadKittiScan(path);
  if (!scan) return {};
  std::erase_if(scan->points, [](const Eigen::Vector3f& point) {
    return !(point.norm() > kMinRange && point.norm() < kMaxRange);
  });
  return std::move(scan->points);
}

/// How nanoflann sees the points.
struct Cloud {
  std::span<const Eigen::Vector3f> points;
  // NOLINTBEGIN(readability-identifier-naming): nanoflann gives these names.
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
  // NOLINTEND(readability-identifier-naming)
};

/// The nearest points of a cloud, the query itself among them if it is one.
class Neighbours {
 public:
  explicit Neighbours(std::span<const Eigen::Vector3f> points) : cloud_{points}, tree_(3, cloud_) {}

  /// Normal of the plane through the points around one, facing the origin.
  Eigen::Vector3f NormalAt(const Eigen::Vector3f& point) const {
    std::uint32_t index[kNormalNeighbours];
    float squared[kNormalNeighbours];
    const std::size_t found = tree_.knnSearch(point.data(), kNormalNeighbours, index, squared);
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (std::size_t k = 0; k < found; ++k) mean += cloud_.points[index[k]];
    mean /= static_cast<float>(found);
    Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
    for (std::size_t k = 0; k < found; ++k) {
      const Eigen::Vector3f offset = cloud_.points[index[k]] - mean;
      covariance += offset * offset.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver(covariance);
    const Eigen::Vector3f normal = solver.eigenvectors().col(0);
    return normal.dot(point) < 0.0f ? normal : Eigen::Vector3f(-normal);
  }

  /// Mean distance from one of the points to the nearest others, m.
  double SpacingAt(const Eigen::Vector3f& point) const {
    std::uint32_t index[kSpacingNeighbours + 1];
    float squared[kSpacingNeighbours + 1];
    const std::size_t found = tree_.knnSearch(point.data(), kSpacingNeighbours + 1, index, squared);
    double sum = 0.0;
    for (std::size_t k = 1; k < found; ++k) sum += std::sqrt(squared[k]);
    return sum / kSpacingNeighbours;
  }

 private:
  Cloud cloud_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3> tree_;
};

RangeMeasurement Measure(const SensorModel& sensor,
                         std::span<const Eigen::Vector3f> points,
                         const Neighbours& neighbours) {
  RangeMeasurement m{
      Image<float>(sensor.Rows(), sensor.Columns(), 0.0f),
      Image<Eigen::Vector3f>(sensor.Rows(), sensor.Columns(), Eigen::Vector3f::Zero())};
  for (const Eigen::Vector3f& point : points) {
    const auto pixel = sensor.Project(point);
    if (!pixel) continue;
    float& range = m.range_m(pixel->row, pixel->column);
    if (range > 0.0f && range <= point.norm()) continue;
    range = point.norm();
    m.normal(pixel->row, pixel->column) = neighbours.NormalAt(point);
  }
  return m;
}

/// Sorts points by the 8 x 8 pixel block of the image that they fall into.
void SortByImage(const SensorModel& sensor, std::vector<Eigen::Vector3f>& points) {
  const auto block_of = [&](const Eigen::Vector3f& point) {
    const Pixel pixel = sensor.Project(point).value_or(Pixel{});
    return std::pair(pixel.row / 8, pixel.column / 8);
  };
  std::stable_sort(points.begin(), points.end(), [&](const auto& a, const auto& b) {
    return block_of(a) < block_of(b);
  });
}

}  // namespace

std::optional<RecordedStreet> RecordedStreet::Load() {
  const std::optional<fs::path> folder = TestData("kitti_raw_0005");
  if (!folder) return std::nullopt;
  const auto scan_path = [&](int scan) {
    return *folder / "velodyne" / fmt::format("{:06d}.bin", scan);
  };
  const auto read = ReadKittiPoses(*folder / "poses_reference.txt");
  if (!read || read->size() <= kLastScan) return std::nullopt;
  const std::vector<SE3>& poses = *read;
  std::vector<Eigen::Vector3f> points;
  for (int scan = kFirstScan; scan <= kLastScan; scan += kScanStep) {
    const SE3 T_view_scan = poses[kViewScan].Inverse() * poses[static_cast<std::size_t>(scan)];
    for (const Eigen::Vector3f& point : ReadPoints(scan_path(scan))) {
      points.push_back((T_view_scan * point.cast<double>()).cast<float>());
    }
  }
  if (points.empty()) return std::nullopt;
  return RecordedStreet(std::move(points), ReadPoints(scan_path(kViewScan)));
}

RecordedStreet::RecordedStreet(std::vector<Eigen::Vector3f> points,
                               std::vector<Eigen::Vector3f> view_points)
    : sensor_(StreetSensor()), points_(std::move(points)) {
  std::erase_if(points_, [&](const Eigen::Vector3f& p) { return !sensor_.Project(p); });
  measurement_ = Measure(sensor_, view_points, Neighbours(points_));
}

GaussianColumns<float> RecordedStreet::Surfels(std::size_t count, double footprint) const {
  Rng rng(1);
  std::vector<Eigen::Vector3f> chosen = points_;
  count = std::min(count, chosen.size());
  for (std::size_t i = 0; i < count; ++i) {
    std::swap(chosen[i], chosen[i + rng.Below(chosen.size() - i)]);
  }
  chosen.resize(count);
  SortByImage(sensor_, chosen);
  const Neighbours all(points_);
  const Neighbours surfels(chosen);
  GaussianColumns<float> table;
  table.Resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f& point = chosen[i];
    const double scale = std::clamp(0.5 * footprint * surfels.SpacingAt(point), 0.005, 1.0);
    const Eigen::Vector2d scales(scale, scale * rng.Uniform(0.6, 1.0));
    const double opacity = rng.Uniform(0.55, 0.9);
    const auto rotation =
        Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), all.NormalAt(point));
    WriteGaussian(table,
                  i,
                  point,
                  rotation,
                  scales.array().log().matrix().cast<float>(),
                  static_cast<float>(std::log(opacity / (1.0 - opacity))));
  }
  return table;
}

}  // namespace covsplat
