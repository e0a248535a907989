#include "covsplat/mesh/clean_mesh.hpp"

#include <numeric>

#include <Eigen/Geometry>

namespace covsplat {
namespace {

/// Vertices of one piece have one root.
class Components {
 public:
  explicit Components(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int Root(int i) {
    while (Parent(i) != i) {
      Parent(i) = Parent(Parent(i));
      i = Parent(i);
    }
    return i;
  }
  void Join(int a, int b) {
    const int root_a = Root(a);
    const int root_b = Root(b);
    Parent(std::max(root_a, root_b)) = std::min(root_a, root_b);
  }

 private:
  int& Parent(int i) { return parent_[static_cast<std::size_t>(i)]; }
  std::vector<int> parent_;
};

double AreaOf(const TriangleMesh& mesh, const Eigen::Vector3i& t) {
  const auto at = [&](int k) -> const Eigen::Vector3f& {
    return mesh.vertices[static_cast<std::size_t>(t[k])];
  };
  return 0.5 * static_cast<double>((at(1) - at(0)).cross(at(2) - at(0)).norm());
}

}  // namespace

void DropSmallComponents(double min_area_m2, TriangleMesh& mesh) {
  Components components(mesh.vertices.size());
  for (const Eigen::Vector3i& t : mesh.triangles) {
    components.Join(t[0], t[1]);
    components.Join(t[0], t[2]);
  }
  std::vector<double> area(mesh.vertices.size(), 0.0);
  for (const Eigen::Vector3i& t : mesh.triangles) {
    area[static_cast<std::size_t>(components.Root(t[0]))] += AreaOf(mesh, t);
  }
  std::erase_if(mesh.triangles, [&](const Eigen::Vector3i& t) {
    return area[static_cast<std::size_t>(components.Root(t[0]))] < min_area_m2;
  });
  std::vector<int> number(mesh.vertices.size(), -1);
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) number[static_cast<std::size_t>(t[k])] = 0;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] < 0) continue;
    number[i] = static_cast<int>(kept);
    mesh.vertices[kept] = mesh.vertices[i];
    if (!mesh.normals.empty()) mesh.normals[kept] = mesh.normals[i];
    ++kept;
  }
  mesh.vertices.resize(kept);
  if (!mesh.normals.empty()) mesh.normals.resize(kept);
  for (Eigen::Vector3i& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) t[k] = number[static_cast<std::size_t>(t[k])];
  }
}

}  // namespace covsplat
