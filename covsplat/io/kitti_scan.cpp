#include "covsplat/io/kitti_scan.hpp"

#include <array>
#include <cmath>
#include <cstring>

#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

using Record = std::array<float, 4>;  // x y z intensity

}  // namespace

Result<Scan> ReadKittiScan(const std::filesystem::path& path) {
  const Result<std::string> bytes = ReadFile(path);
  if (!bytes) return Forward(bytes);
  if (bytes->size() % sizeof(Record) != 0) {
    return Fail(ErrorCode::kInput,
                "{}: holds {} bytes, not a multiple of {} (float32 x y z intensity), so it is "
                "truncated or no KITTI scan; copy it again or leave it out",
                path.string(),
                bytes->size(),
                sizeof(Record));
  }
  Scan scan;
  scan.source = path.string();
  const std::size_t count = bytes->size() / sizeof(Record);
  scan.points.reserve(count);
  scan.intensity.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Record record{};
    std::memcpy(record.data(), bytes->data() + i * sizeof(Record), sizeof(Record));
    scan.points.emplace_back(record[0], record[1], record[2]);
    scan.intensity.push_back(record[3]);
  }
  return scan;
}

Result<std::vector<float>> ReadPointTimes(const std::filesystem::path& path,
                                          std::size_t point_count) {
  const Result<std::string> bytes = ReadFile(path);
  if (!bytes) return Forward(bytes);
  if (bytes->size() != point_count * sizeof(float)) {
    return Fail(ErrorCode::kInput,
                "{}: holds {} bytes where {} points need {} (one float32 each); write it again, or "
                "remove the folder to go on without times of points",
                path.string(),
                bytes->size(),
                point_count,
                point_count * sizeof(float));
  }
  std::vector<float> offsets_s(point_count);
  if (point_count > 0) std::memcpy(offsets_s.data(), bytes->data(), bytes->size());
  return offsets_s;
}

void RaiseElevation(std::span<Eigen::Vector3f> points, double angle_rad) {
  const double cosine = std::cos(angle_rad);
  const double sine = std::sin(angle_rad);
  for (Eigen::Vector3f& point : points) {
    const Eigen::Vector3d p = point.cast<double>();
    const double horizontal = std::hypot(p.x(), p.y());
    if (!(horizontal > 0.0)) continue;  // straight up or down, or not a number: no azimuth
    const double scale = cosine - sine * p.z() / horizontal;
    const double height = cosine * p.z() + sine * horizontal;
    point = Eigen::Vector3d(scale * p.x(), scale * p.y(), height).cast<float>();
  }
}

}  // namespace covsplat
