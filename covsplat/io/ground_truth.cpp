#include "covsplat/io/ground_truth.hpp"

#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

bool Exists(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

// Where KITTI odometry keeps the poses of the sequence in this folder.
fs::path OdometryPoses(const fs::path& recording) {
  std::error_code ignored;
  fs::path folder = fs::canonical(recording, ignored);
  if (folder.parent_path().filename() != "sequences") return {};
  fs::path file = folder.parent_path().parent_path() / "poses" / folder.filename();
  file += ".txt";
  return file;
}

Result<SE3> ReadCameraFromLidar(const fs::path& calibration) {
  const Result<std::string> text = ReadFile(calibration);
  if (!text) return Forward(text);
  LineReader reader(*text);
  while (reader.NextWithContent()) {
    std::string_view line = reader.Line();
    const std::size_t colon = std::min(line.find(':'), line.size());
    const std::string_view key = line.substr(0, colon);
    if (key != "Tr" && key != "Tr_velo_to_cam") continue;
    line.remove_prefix(std::min(colon + 1, line.size()));
    const auto numbers = ParseDoubles(line);
    const auto pose = numbers ? PoseOfMatrix(*numbers) : std::nullopt;
    if (pose) return *pose;
    return Fail(ErrorCode::kInput,
                "{}:{}: {} needs the 12 numbers of a 3x4 matrix",
                calibration.string(),
                reader.Number(),
                key);
  }
  return Fail(ErrorCode::kInput,
              "{}: has no line Tr: or Tr_velo_to_cam:, which leads from the camera of the ground "
              "truth to the LiDAR",
              calibration.string());
}

// T_velo = Tr^-1 * T_cam * Tr
Result<std::vector<SE3>> ReadOdometryPoses(const fs::path& path, const fs::path& calibration) {
  Result<std::vector<SE3>> poses = ReadKittiPoses(path);
  if (!poses) return poses;
  const Result<SE3> T_camera_lidar = ReadCameraFromLidar(calibration);
  if (!T_camera_lidar) return Forward(T_camera_lidar);
  for (SE3& pose : *poses) pose = T_camera_lidar->Inverse() * pose * *T_camera_lidar;
  return poses;
}

// From times.txt, or at even times.
Result<std::vector<double>> StampsFor(const fs::path& recording, std::size_t count, double period) {
  const fs::path file = recording / "times.txt";
  if (Exists(file)) return ReadStamps(file);
  std::vector<double> stamps;
  for (std::size_t i = 0; i < count; ++i) stamps.push_back(static_cast<double>(i) * period);
  return stamps;
}

}  // namespace

Result<std::optional<GroundTruth>> FindGroundTruth(const fs::path& recording,
                                                   double scan_period_s) {
  const auto found = [](const fs::path& path, const Result<Trajectory>& trajectory) {
    return trajectory.map([&](const Trajectory& t) { return std::optional(GroundTruth{path, t}); });
  };
  const fs::path dense = recording / "gt_tum.txt";
  if (Exists(dense)) return found(dense, ReadTum(dense));
  const fs::path own = recording / "poses.txt";
  const fs::path path = Exists(own) ? own : OdometryPoses(recording);
  if (!Exists(path)) return std::optional<GroundTruth>();
  const Result<std::vector<SE3>> poses =
      path == own ? ReadKittiPoses(path) : ReadOdometryPoses(path, recording / "calib.txt");
  if (!poses) return Forward(poses);
  const Result<std::vector<double>> stamps = StampsFor(recording, poses->size(), scan_period_s);
  if (!stamps) return Forward(stamps);
  return found(path, WithStamps(*poses, *stamps, path));
}

Result<Trajectory> ReadOdometryTruth(const fs::path& poses,
                                     const fs::path& recording,
                                     double scan_period_s) {
  const Result<std::vector<SE3>> read = ReadOdometryPoses(poses, recording / "calib.txt");
  if (!read) return Forward(read);
  const Result<std::vector<double>> stamps = StampsFor(recording, read->size(), scan_period_s);
  if (!stamps) return Forward(stamps);
  return WithStamps(*read, *stamps, poses);
}

}  // namespace covsplat
