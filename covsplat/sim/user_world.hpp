// Worlds and ways that users bring along as files.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/result.hpp"
#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

enum class UpAxis { kAuto, kY, kZ };

template <>
struct EnumNames<UpAxis> {
  static constexpr std::array<EnumName<UpAxis>, 3> kNames = {
      {{UpAxis::kAuto, "auto"}, {UpAxis::kY, "y"}, {UpAxis::kZ, "z"}}};
};

struct UserMeshConfig {
  double scale = 1.0;
  UpAxis up = UpAxis::kAuto;
  double reflectivity = 0.5;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field(
        "scale", c.scale, Range{1e-6, 1e6}, "metres per unit of the file: 0.001 for millimetres");
    v.Field("up",
            c.up,
            "the file's axis that points up; auto: y for glTF, as its standard says, z for others");
    v.Field("reflectivity", c.reflectivity, Range{0.0, 1.0}, "of all its surfaces");
  }
};

enum class PathFrame { kSensor, kCamera };

template <>
struct EnumNames<PathFrame> {
  static constexpr std::array<EnumName<PathFrame>, 2> kNames = {
      {{PathFrame::kSensor, "sensor"}, {PathFrame::kCamera, "camera"}}};
};

struct UserRouteConfig {
  std::string file;
  PathFrame frame = PathFrame::kSensor;
  double rate_hz = 10.0;
  std::vector<double> points_m;
  bool closed = false;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field(
        "file", c.file, "poses of the sensor, TUM or KITTI, that it moves along, in their time");
    v.Field(
        "frame",
        c.frame,
        "axes of the poses; sensor: x forward, z up; camera (KITTI odometry): z forward, y down");
    v.Field("rate_hz", c.rate_hz, Range{0.01, 1000.0}, "poses per second of KITTI files");
    v.Field("points_m",
            c.points_m,
            Range{-1e6, 1e6},
            "corners of a way on the ground to walk or drive along: x, y, z, x, y, z, ...");
    v.Field("closed", c.closed, "the way of points_m returns to its first corner");
  }
};

/// Whether a world's name means the file of a mesh: it ends like one.
bool IsMeshFile(std::string_view world);

/// In metres, z up. Files without triangles or with coordinates that are not finite are errors.
Result<WorldMesh> LoadUserMesh(const std::string& file, const UserMeshConfig& config);

/// The motion of `config.file`, in a world whose z axis points up.
Result<Motion> LoadUserMotion(const UserRouteConfig& config);

/// The way of `config.points_m`.
Result<Route> UserRoute(const UserRouteConfig& config);

/// Says what is probably wrong with the size of a mesh, or with where a motion runs in it.
std::vector<std::string> DoubtsAbout(const std::string& file,
                                     const WorldMesh& mesh,
                                     const Motion& motion);

}  // namespace covsplat
