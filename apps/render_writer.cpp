#include "apps/render_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <system_error>

#include <fmt/format.h>

#include "covsplat/io/output_file.hpp"
#include "covsplat/report/png.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 3> kImageFolders = {"range", "normal", "opacity"};

std::string ImageName(std::size_t index) { return fmt::format("{:06}.png", index); }

template <class Pixel>
Result<void> WritePng(const fs::path& path, const Image<Pixel>& image) {
  const Result<std::vector<std::uint8_t>> bytes = EncodePng(image);
  if (!bytes) return Forward(bytes);
  return WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

std::uint8_t Byte(float share) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(share, 0.0f, 1.0f)));
}

/// What a sensor would measure: 0 where the map is too transparent or the reach ends.
Image<float> MeasuredRange(const SensorModel& sensor,
                           const RenderOutput& render,
                           double min_alpha) {
  Image<float> range = render.median_range_m;
  for (std::size_t i = 0; i < range.Size(); ++i) {
    const auto r = static_cast<double>(range.Pixels()[i]);
    const bool seen = static_cast<double>(render.alpha.Pixels()[i]) >= min_alpha &&
                      r >= sensor.MinRange() && r <= sensor.MaxRange();
    if (!seen) range.Pixels()[i] = 0.0f;
  }
  return range;
}

Scan ScanOf(const SensorModel& sensor, const Image<float>& range, const Image<float>& alpha) {
  Scan scan;
  for (int column = 0; column < range.Columns(); ++column) {
    for (int row = 0; row < range.Rows(); ++row) {
      if (!(range(row, column) > 0.0f)) continue;
      scan.points.emplace_back(range(row, column) * sensor.RayOf(row, column));
      scan.intensity.push_back(alpha(row, column));
    }
  }
  return scan;
}

}  // namespace

Result<RenderWriter> RenderWriter::Create(const fs::path& folder, bool overwrite) {
  Result<RecordingWriter> recording = RecordingWriter::Create(folder, overwrite);
  if (!recording) return Forward(recording);
  for (const char* name : kImageFolders) {
    std::error_code error;
    fs::create_directories(folder / name, error);
    for (std::size_t i = 0; !error && fs::remove(folder / name / ImageName(i), error);) ++i;
    if (error) {
      return Fail(ErrorCode::kOutput,
                  "{}: cannot be written: {}",
                  (folder / name).string(),
                  error.message());
    }
  }
  return RenderWriter(folder, std::move(*recording));
}

Result<void> RenderWriter::Write(const SensorModel& sensor,
                                 const RenderOutput& render,
                                 const TimedPose& pose,
                                 double min_alpha) {
  const Image<float> range_m = MeasuredRange(sensor, render, min_alpha);
  const int rows = range_m.Rows();
  const int columns = range_m.Columns();
  Image<std::uint16_t> range(rows, columns);
  Image<Rgb> normal(rows, columns);
  Image<std::uint8_t> opacity(rows, columns);
  for (std::size_t i = 0; i < range_m.Size(); ++i) {
    const double steps = std::round(kRangeImageScale * static_cast<double>(range_m.Pixels()[i]));
    range.Pixels()[i] = static_cast<std::uint16_t>(
        std::min(steps, static_cast<double>(std::numeric_limits<std::uint16_t>::max())));
    const Eigen::Vector3f half = 0.5f * render.normal.Pixels()[i].array() + 0.5f;
    normal.Pixels()[i] = {Byte(half.x()), Byte(half.y()), Byte(half.z())};
    opacity.Pixels()[i] = Byte(render.alpha.Pixels()[i]);
  }
  const std::string name = ImageName(poses_.size());
  poses_.push_back(pose);
  Scan scan = ScanOf(sensor, range_m, render.alpha);
  scan.stamp_s = pose.stamp_s;
  return WritePng(folder_ / "range" / name, range)
      .and_then([&] { return WritePng(folder_ / "normal" / name, normal); })
      .and_then([&] { return WritePng(folder_ / "opacity" / name, opacity); })
      .and_then([&] { return recording_.Write(scan, pose.T_world_sensor); });
}

Result<void> RenderWriter::Finish() { return recording_.Finish(poses_); }

}  // namespace covsplat
