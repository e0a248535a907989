#include "covsplat/sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <embree3/rtcore.h>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

using Eigen::Vector3f;

template <class T>
void FillBuffer(RTCGeometry geometry,
                RTCBufferType type,
                RTCFormat format,
                const std::vector<T>& items) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), items.size());
  COVSPLAT_CHECK(buffer != nullptr);
  std::memcpy(buffer, items.data(), items.size() * sizeof(T));
}

// Nearest point of a segment.
Vector3f NearestOnEdge(const Vector3f& point, const Vector3f& from, const Vector3f& to) {
  const Vector3f edge = to - from;
  const float length2 = edge.squaredNorm();
  const float s = length2 > 0.0f ? (point - from).dot(edge) / length2 : 0.0f;
  return from + std::clamp(s, 0.0f, 1.0f) * edge;
}

float DistanceToTriangle(const Vector3f& point,
                         const Vector3f& a,
                         const Vector3f& b,
                         const Vector3f& c) {
  const Vector3f normal = (b - a).cross(c - a);
  const auto left_of = [&](const Vector3f& from, const Vector3f& to) {
    return (to - from).cross(point - from).dot(normal) >= 0.0f;
  };
  const float area = normal.norm();
  if (area > 0.0f && left_of(a, b) && left_of(b, c) && left_of(c, a)) {
    return std::abs(normal.dot(point - a)) / area;
  }
  return std::min({(point - NearestOnEdge(point, a, b)).norm(),
                   (point - NearestOnEdge(point, b, c)).norm(),
                   (point - NearestOnEdge(point, c, a)).norm()});
}

struct DistanceQuery {
  const WorldMesh* mesh = nullptr;
  Vector3f point;
  float nearest = 0.0f;
};

// Embree calls it for every triangle whose box is within the query's radius.
bool VisitTriangle(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<DistanceQuery*>(arguments->userPtr);
  const auto corner = [&](int k) -> const Vector3f& {
    return query.mesh
        ->vertices[static_cast<std::size_t>(query.mesh->triangles[arguments->primID](k))];
  };
  const float distance = DistanceToTriangle(query.point, corner(0), corner(1), corner(2));
  if (distance >= query.nearest) return false;
  query.nearest = distance;
  arguments->query->radius = distance;
  return true;  // the radius shrank
}

}  // namespace

struct Scene::Index {
  explicit Index(WorldMesh triangles) : mesh(std::move(triangles)) {
    COVSPLAT_CHECK(mesh.reflectivity.size() == mesh.triangles.size());
    device = rtcNewDevice("threads=1");
    COVSPLAT_CHECK(device != nullptr);
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips through a seam
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    FillBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.vertices);
    FillBuffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }
  ~Index() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Index(const Index&) = delete;
  Index& operator=(const Index&) = delete;

  WorldMesh mesh;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

Scene::Scene(WorldMesh mesh) : index_(std::make_unique<const Index>(std::move(mesh))) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

const WorldMesh& Scene::Mesh() const { return index_->mesh; }

std::optional<Scene::Hit> Scene::Cast(const Vector3f& origin,
                                      const Vector3f& direction,
                                      float max_range_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray.org_x = origin.x();
  query.ray.org_y = origin.y();
  query.ray.org_z = origin.z();
  query.ray.dir_x = direction.x();
  query.ray.dir_y = direction.y();
  query.ray.dir_z = direction.z();
  query.ray.tfar = max_range_m;
  query.ray.mask = 0xFFFFFFFFu;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(index_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  Vector3f normal = Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  if (normal.dot(direction) > 0.0f) normal = -normal;
  return Hit{query.ray.tfar, normal, Mesh().reflectivity[query.hit.primID], query.hit.primID};
}

std::optional<float> Scene::DistanceTo(const Vector3f& point, float max_distance_m) const {
  DistanceQuery nearest{&Mesh(), point, max_distance_m};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  RTCPointQuery query{};
  query.x = point.x();
  query.y = point.y();
  query.z = point.z();
  query.radius = max_distance_m;
  if (!rtcPointQuery(index_->scene, &query, &context, VisitTriangle, &nearest)) return std::nullopt;
  return nearest.nearest;
}

}  // namespace covsplat
