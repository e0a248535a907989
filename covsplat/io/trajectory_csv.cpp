#include "covsplat/io/trajectory_csv.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

constexpr double kQuaternionTolerance = 0.01;
constexpr double kSecondsPerNanosecond = 1e-9;

bool IsWhole(double number) { return std::isfinite(number) && number == std::floor(number); }

/// x y z and a unit quaternion, or nothing.
std::optional<SE3> PoseOf(std::span<const double, 3> position, const Eigen::Quaterniond& rotation) {
  const bool finite = std::all_of(
      position.begin(), position.end(), [](double number) { return std::isfinite(number); });
  const bool unit = std::abs(rotation.norm() - 1.0) <= kQuaternionTolerance;
  if (!finite || !unit) return std::nullopt;
  return SE3(rotation, {position[0], position[1], position[2]});
}

std::optional<TimedPose> EurocPose(std::span<const double> n) {
  if (n.size() < 8 || !IsWhole(n[0])) return std::nullopt;
  const auto pose = PoseOf(n.subspan<1, 3>(), Eigen::Quaterniond(n[4], n[5], n[6], n[7]));
  if (!pose) return std::nullopt;
  return TimedPose{kSecondsPerNanosecond * n[0], *pose};
}

std::optional<TimedPose> NewerCollegePose(std::span<const double> n) {
  if (n.size() != 9 || !IsWhole(n[0]) || !IsWhole(n[1])) return std::nullopt;
  if (!(n[1] >= 0.0 && n[1] < 1.0 / kSecondsPerNanosecond)) return std::nullopt;
  const auto pose = PoseOf(n.subspan<2, 3>(), Eigen::Quaterniond(n[8], n[5], n[6], n[7]));
  if (!pose) return std::nullopt;
  return TimedPose{n[0] + kSecondsPerNanosecond * n[1], *pose};
}

template <class PoseOfRow>
Result<Trajectory> ReadCsv(const std::filesystem::path& path,
                           std::string_view expected,
                           PoseOfRow&& pose_of_row) {
  const Result<std::string> text = ReadFile(path);
  if (!text) return Forward(text);
  const auto bad_line = [&](const LineReader& reader, std::string_view problem) {
    return Fail(ErrorCode::kInput, "{}:{}: {}", path.string(), reader.Number(), problem);
  };
  LineReader reader(*text);
  Trajectory trajectory;
  bool first = true;
  while (reader.NextWithContent()) {
    std::string line(reader.Line());
    std::replace(line.begin(), line.end(), ',', ' ');
    const auto numbers = ParseDoubles(line);
    const bool names = first && !numbers;
    first = false;
    if (names) continue;
    if (!numbers) return bad_line(reader, "holds something that is not a number");
    const std::optional<TimedPose> pose = pose_of_row(*numbers);
    if (!pose) return bad_line(reader, expected);
    if (!trajectory.empty() && pose->stamp_s <= trajectory.back().stamp_s) {
      return bad_line(reader, "its time is not later than that of the line before");
    }
    trajectory.push_back(*pose);
  }
  return trajectory;
}

}  // namespace

Result<Trajectory> ReadEurocCsv(const std::filesystem::path& path) {
  return ReadCsv(path,
                 "expected stamp,x,y,z,qw,qx,qy,qz (EuRoC) with the stamp in whole nanoseconds and "
                 "a quaternion of length 1",
                 EurocPose);
}

Result<Trajectory> ReadNewerCollegeCsv(const std::filesystem::path& path) {
  return ReadCsv(path,
                 "expected sec,nsec,x,y,z,qx,qy,qz,qw (Newer College) with whole seconds and "
                 "nanoseconds and a quaternion of length 1",
                 NewerCollegePose);
}

}  // namespace covsplat
