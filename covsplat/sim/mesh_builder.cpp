#include "covsplat/sim/mesh_builder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

std::array<Vector3f, 12> IcosahedronVertices() {
  const float g = std::numbers::phi_v<float>;
  std::array<Vector3f, 12> vertices = {Vector3f(-1, g, 0),
                                       Vector3f(1, g, 0),
                                       Vector3f(-1, -g, 0),
                                       Vector3f(1, -g, 0),
                                       Vector3f(0, -1, g),
                                       Vector3f(0, 1, g),
                                       Vector3f(0, -1, -g),
                                       Vector3f(0, 1, -g),
                                       Vector3f(g, 0, -1),
                                       Vector3f(g, 0, 1),
                                       Vector3f(-g, 0, -1),
                                       Vector3f(-g, 0, 1)};
  for (Vector3f& vertex : vertices) vertex.normalize();
  return vertices;
}

constexpr int kIcosahedron[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                     {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                     {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                     {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};

using Facet = std::array<Vector3f, 3>;

// Facets of the unit icosphere.
std::vector<Facet> Icosphere(int subdivisions) {
  const std::array<Vector3f, 12> corners = IcosahedronVertices();
  std::vector<Facet> facets;
  for (const auto& face : kIcosahedron) {
    facets.push_back({corners[static_cast<std::size_t>(face[0])],
                      corners[static_cast<std::size_t>(face[1])],
                      corners[static_cast<std::size_t>(face[2])]});
  }
  for (int level = 0; level < subdivisions; ++level) {
    std::vector<Facet> finer;
    finer.reserve(4 * facets.size());
    for (const auto& [a, b, c] : facets) {
      const Vector3f ab = (a + b).normalized();
      const Vector3f bc = (b + c).normalized();
      const Vector3f ca = (c + a).normalized();
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    facets = std::move(finer);
  }
  return facets;
}

// Sorted borders of the cells into which openings cut a wall.
std::vector<float> Cuts(float low, float high, std::vector<float> between) {
  between.push_back(low);
  between.push_back(high);
  for (float& cut : between) cut = std::clamp(cut, low, high);
  std::sort(between.begin(), between.end());
  between.erase(std::unique(between.begin(), between.end()), between.end());
  return between;
}

bool Contains(const Opening& opening, float u, float z) {
  return u > opening.u_low && u < opening.u_high && z > opening.z_low && z < opening.z_high;
}

}  // namespace

int MeshBuilder::Vertex(const Vector3f& position) {
  mesh_.vertices.push_back(position);
  return static_cast<int>(mesh_.vertices.size()) - 1;
}

void MeshBuilder::Triangle(int a, int b, int c, float reflectivity) {
  mesh_.triangles.emplace_back(a, b, c);
  mesh_.reflectivity.push_back(reflectivity);
}

void MeshBuilder::Facet(const Vector3f& a,
                        const Vector3f& b,
                        const Vector3f& c,
                        float reflectivity) {
  const int first = Vertex(a);
  Vertex(b);
  Vertex(c);
  Triangle(first, first + 1, first + 2, reflectivity);
}

void MeshBuilder::Quad(const Vector3f& a,
                       const Vector3f& b,
                       const Vector3f& c,
                       const Vector3f& d,
                       float reflectivity) {
  const int first = Vertex(a);
  Vertex(b);
  Vertex(c);
  Vertex(d);
  Triangle(first, first + 1, first + 2, reflectivity);
  Triangle(first, first + 2, first + 3, reflectivity);
}

void MeshBuilder::Box(const Vector3f& base,
                      const Vector3f& size,
                      float yaw_rad,
                      float reflectivity) {
  const Vector3f along = 0.5f * size.x() * Vector3f(std::cos(yaw_rad), std::sin(yaw_rad), 0.0f);
  const Vector3f across = 0.5f * size.y() * Vector3f(-std::sin(yaw_rad), std::cos(yaw_rad), 0.0f);
  const Vector3f up(0.0f, 0.0f, size.z());
  const std::array<Vector3f, 4> corner = {
      base - along - across, base + along - across, base + along + across, base - along + across};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3f& next = corner[(i + 1) % 4];
    Quad(corner[i], next, next + up, corner[i] + up, reflectivity);
  }
  Quad(corner[0], corner[1], corner[2], corner[3], reflectivity);
  Quad(corner[0] + up, corner[1] + up, corner[2] + up, corner[3] + up, reflectivity);
}

void MeshBuilder::Cylinder(const Vector3f& base,
                           float bottom_radius,
                           float top_radius,
                           float height,
                           int sides,
                           float reflectivity) {
  const Vector3f up(0.0f, 0.0f, height);
  const int centre = Vertex(base + up);
  for (int i = 0; i < sides; ++i) {
    const auto direction = [&](int k) {
      const float angle = 2.0f * kPi * static_cast<float>(k) / static_cast<float>(sides);
      return Vector3f(std::cos(angle), std::sin(angle), 0.0f);
    };
    const Vector3f here = direction(i);
    const Vector3f next = direction(i + 1);
    Quad(base + bottom_radius * here,
         base + bottom_radius * next,
         base + up + top_radius * next,
         base + up + top_radius * here,
         reflectivity);
    const int rim = static_cast<int>(mesh_.vertices.size()) - 2;
    Triangle(centre, rim, rim + 1, reflectivity);
  }
}

void MeshBuilder::Ellipsoid(const Vector3f& centre,
                            const Vector3f& radii,
                            int subdivisions,
                            float reflectivity) {
  for (const auto& [a, b, c] : Icosphere(subdivisions)) {
    Facet(centre + radii.cwiseProduct(a),
          centre + radii.cwiseProduct(b),
          centre + radii.cwiseProduct(c),
          reflectivity);
  }
}

void MeshBuilder::HeightField(const Eigen::Vector2f& low,
                              const Eigen::Vector2f& high,
                              float cell_m,
                              const std::function<float(float, float)>& height,
                              const std::function<float(float, float)>& reflectivity) {
  const int columns = std::max(1, static_cast<int>(std::ceil((high.x() - low.x()) / cell_m)));
  const int rows = std::max(1, static_cast<int>(std::ceil((high.y() - low.y()) / cell_m)));
  const Eigen::Vector2f cell((high.x() - low.x()) / static_cast<float>(columns),
                             (high.y() - low.y()) / static_cast<float>(rows));
  const auto first = static_cast<int>(mesh_.vertices.size());
  for (int i = 0; i <= rows; ++i) {
    for (int j = 0; j <= columns; ++j) {
      const float x = low.x() + cell.x() * static_cast<float>(j);
      const float y = low.y() + cell.y() * static_cast<float>(i);
      Vertex({x, y, height(x, y)});
    }
  }
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const float shade = reflectivity(low.x() + cell.x() * (static_cast<float>(j) + 0.5f),
                                       low.y() + cell.y() * (static_cast<float>(i) + 0.5f));
      const int corner = first + i * (columns + 1) + j;
      const int above = corner + columns + 1;
      Triangle(corner, corner + 1, above + 1, shade);
      Triangle(corner, above + 1, above, shade);
    }
  }
}

void MeshBuilder::Recess(const Panel& panel, const Opening& opening, float reflectivity) {
  const std::array<Eigen::Vector2f, 4> edge = {Eigen::Vector2f(opening.u_low, opening.z_low),
                                               Eigen::Vector2f(opening.u_high, opening.z_low),
                                               Eigen::Vector2f(opening.u_high, opening.z_high),
                                               Eigen::Vector2f(opening.u_low, opening.z_high)};
  const auto corner = [&](std::size_t k, float depth) {
    return panel.At(edge[k % 4].x(), edge[k % 4].y(), depth);
  };
  const float back = opening.depth;
  if (back <= 0.0f) return;
  for (std::size_t k = 0; k < 4; ++k) {
    Quad(corner(k, 0.0f), corner(k + 1, 0.0f), corner(k + 1, back), corner(k, back), reflectivity);
  }
  if (opening.through) return;
  Quad(corner(0, back),
       corner(1, back),
       corner(2, back),
       corner(3, back),
       opening.back_reflectivity);
}

void MeshBuilder::Wall(const Panel& panel,
                       float width,
                       float z_low,
                       float z_high,
                       const std::vector<Opening>& openings,
                       float reflectivity) {
  std::vector<float> u_cuts;
  std::vector<float> z_cuts;
  for (const Opening& opening : openings) {
    u_cuts.insert(u_cuts.end(), {opening.u_low, opening.u_high});
    z_cuts.insert(z_cuts.end(), {opening.z_low, opening.z_high});
    Recess(panel, opening, reflectivity);
  }
  u_cuts = Cuts(0.0f, width, std::move(u_cuts));
  z_cuts = Cuts(z_low, z_high, std::move(z_cuts));
  for (std::size_t i = 0; i + 1 < u_cuts.size(); ++i) {
    for (std::size_t j = 0; j + 1 < z_cuts.size(); ++j) {
      const float u = 0.5f * (u_cuts[i] + u_cuts[i + 1]);
      const float z = 0.5f * (z_cuts[j] + z_cuts[j + 1]);
      const auto inside = [&](const Opening& opening) { return Contains(opening, u, z); };
      if (std::any_of(openings.begin(), openings.end(), inside)) continue;
      Quad(panel.At(u_cuts[i], z_cuts[j]),
           panel.At(u_cuts[i + 1], z_cuts[j]),
           panel.At(u_cuts[i + 1], z_cuts[j + 1]),
           panel.At(u_cuts[i], z_cuts[j + 1]),
           reflectivity);
    }
  }
}

void MeshBuilder::Arch(const Panel& panel,
                       float u_low,
                       float u_high,
                       float spring_m,
                       float top_m,
                       float thickness,
                       float reflectivity) {
  constexpr int kSegments = 16;
  const float radius = 0.5f * (u_high - u_low);
  const auto point = [&](int k, float depth) {
    const float angle = kPi * static_cast<float>(k) / kSegments;
    return panel.At(
        u_low + radius * (1.0f - std::cos(angle)), spring_m + radius * std::sin(angle), depth);
  };
  const auto above = [&](int k, float depth) {
    Vector3f top = point(k, depth);
    top.z() = panel.origin.z() + top_m;
    return top;
  };
  for (int k = 0; k < kSegments; ++k) {
    for (const float depth : {0.0f, thickness}) {
      Quad(
          point(k, depth), point(k + 1, depth), above(k + 1, depth), above(k, depth), reflectivity);
    }
    Quad(point(k, 0.0f),
         point(k + 1, 0.0f),
         point(k + 1, thickness),
         point(k, thickness),
         reflectivity);
  }
}

}  // namespace covsplat
