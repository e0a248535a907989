#include "covsplat/sim/user_world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "covsplat/io/mesh_reader.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

bool IsYUp(const std::string& file, UpAxis up) {
  return up == UpAxis::kAuto ? IsYUpByStandard(file) : up == UpAxis::kY;
}

Eigen::AlignedBox3f BoundsOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : mesh.vertices) box.extend(vertex);
  return box;
}

// 12 numbers a line are KITTI's; TUM has 8, and reports what is wrong with anything else.
Result<bool> IsKittiFile(const std::string& file) {
  const Result<std::string> text = ReadFile(file);
  if (!text) return Forward(text);
  LineReader lines(*text);
  return lines.NextWithContent() && SplitWords(lines.Line()).size() == 12;
}

Result<Trajectory> ReadPath(const UserRouteConfig& config) {
  const Result<bool> kitti = IsKittiFile(config.file);
  if (!kitti) return Forward(kitti);
  if (!*kitti) return ReadTum(config.file);
  const Result<std::vector<SE3>> poses = ReadKittiPoses(config.file);
  if (!poses) return Forward(poses);
  std::vector<double> stamps_s;
  for (std::size_t i = 0; i < poses->size(); ++i) {
    stamps_s.push_back(static_cast<double>(i) / config.rate_hz);
  }
  return WithStamps(*poses, stamps_s, config.file);
}

// T_sensor_camera: from camera axes (x right, y down, z forward) to those of a sensor (x forward, y
// left, z up).
SE3 CameraAxes() {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return SE3::FromMatrix(matrix);
}

}  // namespace

bool IsMeshFile(std::string_view world) { return IsMeshFileName(std::string(world)); }

Result<WorldMesh> LoadUserMesh(const std::string& file, const UserMeshConfig& config) {
  Result<TriangleMesh> read = ReadMeshFile(file);
  if (!read) return Forward(read);
  WorldMesh mesh;
  static_cast<TriangleMesh&>(mesh) = std::move(*read);
  const bool y_up = IsYUp(file, config.up);
  for (Eigen::Vector3f& vertex : mesh.vertices) {
    if (y_up) vertex = Eigen::Vector3f(vertex.x(), -vertex.z(), vertex.y());
    vertex *= static_cast<float>(config.scale);
  }
  mesh.reflectivity.assign(mesh.triangles.size(), static_cast<float>(config.reflectivity));
  return mesh;
}

Result<Motion> LoadUserMotion(const UserRouteConfig& config) {
  Result<Trajectory> path = ReadPath(config);
  if (!path) return Forward(path);
  if (path->size() < 2) {
    return Fail(ErrorCode::kInput,
                "{}: has {} poses; a motion needs two or more",
                config.file,
                path->size());
  }
  if (config.frame == PathFrame::kCamera) {
    const SE3 T_sensor_camera = CameraAxes();
    const SE3 T_camera_sensor = T_sensor_camera.Inverse();
    for (TimedPose& pose : *path) {
      pose.T_world_sensor = T_sensor_camera * pose.T_world_sensor * T_camera_sensor;
    }
  }
  return MotionAlong(*path);
}

Result<Route> UserRoute(const UserRouteConfig& config) {
  const std::size_t numbers = config.points_m.size();
  if (numbers % 3 != 0 || numbers < (config.closed ? 9u : 6u)) {
    return Fail(ErrorCode::kUsage,
                "route.points_m has {} numbers; give x, y, z for {} corners or more",
                numbers,
                config.closed ? 3 : 2);
  }
  std::vector<Eigen::Vector3d> corners;
  for (std::size_t i = 0; i < numbers; i += 3) {
    corners.emplace_back(config.points_m[i], config.points_m[i + 1], config.points_m[i + 2]);
    if (i > 0 && corners.back() == corners[corners.size() - 2]) {
      return Fail(ErrorCode::kUsage, "route.points_m names a corner twice in a row");
    }
  }
  Route route;
  route.controls = AlongLines(corners, config.closed, 1.0);
  route.closed = config.closed;
  return route;
}

std::vector<std::string> DoubtsAbout(const std::string& file,
                                     const WorldMesh& mesh,
                                     const Motion& motion) {
  constexpr float kTooLargeM = 5000.0f;
  constexpr float kTooSmallM = 2.0f;
  std::vector<std::string> doubts;
  const Eigen::AlignedBox3f box = BoundsOf(mesh);
  const float size_m = box.diagonal().norm();
  if (size_m > kTooLargeM) {
    doubts.push_back(
        fmt::format("{}: is {:.0f} m across; if its unit is the millimetre, give "
                    "-s mesh.scale=0.001",
                    file,
                    size_m));
  }
  if (size_m < kTooSmallM) {
    doubts.push_back(
        fmt::format("{}: is {:.3f} m across; if its unit is the kilometre, give "
                    "-s mesh.scale=1000",
                    file,
                    size_m));
  }
  const float outside_m =
      box.exteriorDistance(motion.PoseAt(0.0).Translation().cast<float>().eval());
  if (outside_m > 0.5f * size_m) {
    doubts.push_back(
        fmt::format("{}: the way begins {:.0f} m outside of it; do their frames and "
                    "units agree?",
                    file,
                    outside_m));
  }
  return doubts;
}

}  // namespace covsplat
