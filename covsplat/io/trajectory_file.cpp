#include "covsplat/io/trajectory_file.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string_view>

#include "covsplat/io/output_file.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_csv.hpp"

namespace covsplat {
namespace {

// Some programs write quaternions and matrices with four decimals.
constexpr double kRotationTolerance = 0.01;

tl::unexpected<Error> BadLine(const std::filesystem::path& path,
                              const LineReader& reader,
                              std::string_view problem) {
  return Fail(ErrorCode::kInput, "{}:{}: {}", path.string(), reader.Number(), problem);
}

bool AllFinite(std::span<const double> numbers) {
  for (const double number : numbers) {
    if (!std::isfinite(number)) return false;
  }
  return true;
}

std::optional<TimedPose> TumPose(std::span<const double> n) {
  if (n.empty() || !std::isfinite(n[0])) return std::nullopt;
  const std::optional<SE3> pose = ParsePose(n.subspan(1));
  return pose ? std::optional(TimedPose{n[0], *pose}) : std::nullopt;
}

// "2011-09-26 13:02:25.594360375", as KITTI's raw recordings have it, in seconds since 1970 (UTC).
std::optional<double> DatedStamp(std::string_view date, std::string_view time_of_day) {
  const auto number = [](std::string_view text, std::size_t from, std::size_t count) {
    return text.size() < from ? std::nullopt : ParseDouble(text.substr(from, count));
  };
  const auto year = number(date, 0, 4), month = number(date, 5, 2), day = number(date, 8, 2);
  const auto hour = number(time_of_day, 0, 2), minute = number(time_of_day, 3, 2);
  const auto second = number(time_of_day, 6, std::string_view::npos);
  if (!year || !month || !day || !hour || !minute || !second) return std::nullopt;
  const std::chrono::year_month_day civil{std::chrono::year(static_cast<int>(*year)),
                                          std::chrono::month(static_cast<unsigned>(*month)),
                                          std::chrono::day(static_cast<unsigned>(*day))};
  if (!civil.ok()) return std::nullopt;
  const auto days = std::chrono::sys_days(civil).time_since_epoch().count();
  return ((static_cast<double>(days) * 24.0 + *hour) * 60.0 + *minute) * 60.0 + *second;
}

std::optional<double> StampOf(std::string_view line) {
  const std::vector<std::string_view> words = SplitWords(line);
  if (words.size() == 1) return ParseDouble(words[0]);
  if (words.size() == 2) return DatedStamp(words[0], words[1]);
  return std::nullopt;
}

std::string WithoutCommas(std::string_view line) {
  std::string words(line);
  std::replace(words.begin(), words.end(), ',', ' ');
  return words;
}

// Calls take(numbers) for every line with content; take returns what is wrong with it, or "".
template <class Take>
Result<void> ForEachLine(const std::filesystem::path& path, Take&& take) {
  const Result<std::string> text = ReadFile(path);
  if (!text) return Forward(text);
  LineReader reader(*text);
  while (reader.NextWithContent()) {
    const auto numbers = ParseDoubles(reader.Line());
    if (!numbers) return BadLine(path, reader, "holds something that is not a number");
    const std::string_view problem = take(*numbers);
    if (!problem.empty()) return BadLine(path, reader, problem);
  }
  return {};
}

}  // namespace

std::string PoseText(const SE3& pose) {
  const Eigen::Vector3d& t = pose.Translation();
  const Eigen::Quaterniond& q = pose.Rotation();
  return fmt::format("{} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

std::optional<SE3> ParsePose(std::span<const double> n) {
  if (n.size() != 7 || !AllFinite(n)) return std::nullopt;
  const Eigen::Quaterniond rotation(n[6], n[3], n[4], n[5]);
  if (std::abs(rotation.norm() - 1.0) > kRotationTolerance) return std::nullopt;
  return SE3(rotation, {n[0], n[1], n[2]});
}

std::string TumLine(const TimedPose& pose) {
  return fmt::format("{:.9f} {}\n", pose.stamp_s, PoseText(pose.T_world_sensor));
}

std::string KittiLine(const SE3& pose) {
  const Eigen::Matrix4d matrix = pose.Matrix();
  std::string line;
  for (int k = 0; k < 12; ++k) {
    line += fmt::format("{}{}", k == 0 ? "" : " ", matrix(k / 4, k % 4));
  }
  return line + "\n";
}

Result<void> WriteTum(const std::filesystem::path& path, const Trajectory& trajectory) {
  std::string text;
  for (const TimedPose& pose : trajectory) text += TumLine(pose);
  return WriteFileAtomically(path, text);
}

Result<void> WriteKittiPoses(const std::filesystem::path& path, const Trajectory& trajectory) {
  std::string text;
  for (const TimedPose& pose : trajectory) text += KittiLine(pose.T_world_sensor);
  return WriteFileAtomically(path, text);
}

Result<Trajectory> ReadTum(const std::filesystem::path& path) {
  Trajectory trajectory;
  const Result<void> read = ForEachLine(path, [&](const std::vector<double>& numbers) {
    const std::optional<TimedPose> pose = TumPose(numbers);
    if (!pose) return "expected stamp x y z qx qy qz qw with a quaternion of length 1";
    if (!trajectory.empty() && pose->stamp_s <= trajectory.back().stamp_s) {
      return "its time is not later than that of the line before";
    }
    trajectory.push_back(*pose);
    return "";
  });
  if (!read) return Forward(read);
  return trajectory;
}

Result<std::vector<SE3>> ReadKittiPoses(const std::filesystem::path& path) {
  std::vector<SE3> poses;
  const Result<void> read = ForEachLine(path, [&](const std::vector<double>& numbers) {
    const std::optional<SE3> pose = PoseOfMatrix(numbers);
    if (!pose) return "expected the 12 numbers of a 3x4 matrix of rotation and translation";
    poses.push_back(*pose);
    return "";
  });
  if (!read) return Forward(read);
  return poses;
}

Result<std::vector<double>> ReadStamps(const std::filesystem::path& path) {
  const Result<std::string> text = ReadFile(path);
  if (!text) return Forward(text);
  std::vector<double> stamps;
  LineReader reader(*text);
  while (reader.NextWithContent()) {
    const std::optional<double> stamp_s = StampOf(reader.Line());
    if (!stamp_s || !std::isfinite(*stamp_s)) {
      return BadLine(path, reader, "expected one time in seconds, or a date and a time of day");
    }
    if (!stamps.empty() && *stamp_s < stamps.back()) {
      return BadLine(path, reader, "its time is earlier than that of the line before");
    }
    stamps.push_back(*stamp_s);
  }
  return stamps;
}

Result<TrajectoryFormat> DetectTrajectoryFormat(const std::filesystem::path& path) {
  const Result<std::string> text = ReadFile(path);
  if (!text) return Forward(text);
  LineReader reader(*text);
  bool any = reader.NextWithContent();
  // A line of names may come before the numbers of a CSV file.
  if (any && reader.Number() == 1 && reader.Line().find(',') != std::string_view::npos &&
      !ParseDoubles(WithoutCommas(reader.Line()))) {
    any = reader.NextWithContent();
  }
  if (!any) return Fail(ErrorCode::kInput, "{}: holds no poses", path.string());
  const bool commas = reader.Line().find(',') != std::string_view::npos;
  const std::size_t columns = SplitWords(WithoutCommas(reader.Line())).size();
  if (!commas && columns == 8) return TrajectoryFormat::kTum;
  if (!commas && columns == 12) return TrajectoryFormat::kKitti;
  if (commas && columns == 9) return TrajectoryFormat::kNewerCollege;
  if (commas && columns >= 8) return TrajectoryFormat::kEuroc;
  return BadLine(path,
                 reader,
                 fmt::format("has {} columns{}; expected 8 numbers (TUM) or 12 (KITTI) between "
                             "blanks, or 9 (Newer College) or 8 and more (EuRoC) between commas",
                             columns,
                             commas ? " between commas" : ""));
}

Result<Trajectory> LoadTrajectory(const std::filesystem::path& path,
                                  std::span<const double> stamps_s) {
  const Result<TrajectoryFormat> format = DetectTrajectoryFormat(path);
  if (!format) return Forward(format);
  if (*format == TrajectoryFormat::kTum) return ReadTum(path);
  if (*format == TrajectoryFormat::kEuroc) return ReadEurocCsv(path);
  if (*format == TrajectoryFormat::kNewerCollege) return ReadNewerCollegeCsv(path);
  const Result<std::vector<SE3>> poses = ReadKittiPoses(path);
  if (!poses) return Forward(poses);
  return WithStamps(*poses, stamps_s, path);
}

Result<Trajectory> WithStamps(const std::vector<SE3>& poses,
                              std::span<const double> stamps_s,
                              const std::filesystem::path& path) {
  if (poses.size() != stamps_s.size()) {
    return Fail(ErrorCode::kInput,
                "{}: holds {} poses for {} times; they have to match line by line",
                path.string(),
                poses.size(),
                stamps_s.size());
  }
  Trajectory trajectory;
  for (std::size_t i = 0; i < poses.size(); ++i) trajectory.push_back({stamps_s[i], poses[i]});
  return trajectory;
}

std::optional<SE3> PoseOfMatrix(std::span<const double> numbers) {
  if (numbers.size() != 12 || !AllFinite(numbers)) return std::nullopt;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (int k = 0; k < 12; ++k) matrix(k / 4, k % 4) = numbers[static_cast<std::size_t>(k)];
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const Eigen::Matrix3d gram = rotation * rotation.transpose();
  const bool orthonormal = gram.isIdentity(kRotationTolerance) && rotation.determinant() > 0.0;
  if (!orthonormal) return std::nullopt;
  return SE3::FromMatrix(matrix);
}

}  // namespace covsplat
