#include "covsplat/report/map_picture.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "covsplat/report/colormap.hpp"

namespace covsplat {
namespace {

constexpr int kOversampling = 2;
constexpr double kDiscSigmas = 1.4;
constexpr double kMinRadiusPx = 0.8;
constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr Rgb kPathColor{255, 72, 60};

/// Where metres fall on the picture.
struct Frame {
  double low_x = 0.0, high_y = 0.0, px_per_m = 1.0;
  int rows = 1, columns = 1;

  Eigen::Vector2d Pixel(const Eigen::Vector3d& p) const {
    return {(p.x() - low_x) * px_per_m, (high_y - p.y()) * px_per_m};
  }
};

/// What the viewer sees: depth towards the viewer, height in the map, and shade.
struct Canvas {
  Image<float> depth;
  Image<float> height;
  Image<float> shade;
};

/// Limits of all but the outermost shares of the values.
std::pair<double, double> Robust(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double s) {
    return values[static_cast<std::size_t>(s * static_cast<double>(values.size() - 1))];
  };
  return {at(share), at(1.0 - share)};
}

Frame FitFrame(const SavedMap& map, std::span<const Eigen::Vector3d> path, const MapView& view) {
  std::vector<double> xs, ys;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const Eigen::Vector3d p = view.R_view_map * MeanOf(map.gaussians, i).cast<double>();
    xs.push_back(p.x());
    ys.push_back(p.y());
  }
  auto [low_x, high_x] = Robust(std::move(xs), 0.01);
  auto [low_y, high_y] = Robust(std::move(ys), 0.01);
  for (const Eigen::Vector3d& point : path) {
    const Eigen::Vector3d p = view.R_view_map * point;
    low_x = std::min(low_x, p.x());
    high_x = std::max(high_x, p.x());
    low_y = std::min(low_y, p.y());
    high_y = std::max(high_y, p.y());
  }
  const double margin = 0.03 * std::max({high_x - low_x, high_y - low_y, 1.0});
  const double width = high_x - low_x + 2.0 * margin;
  const double height = high_y - low_y + 2.0 * margin;
  Frame frame;
  frame.px_per_m = kOversampling * std::min(view.width_px / width, view.max_height_px / height);
  frame.low_x = low_x - margin;
  frame.high_y = high_y + margin;
  const auto cells = [&](double m) {
    return kOversampling * std::max(1, static_cast<int>(m * frame.px_per_m) / kOversampling);
  };
  frame.columns = cells(width);
  frame.rows = cells(height);
  return frame;
}

/// A disc in the picture: the ellipse {d : d^T inverse d <= 1}, and how its depth changes over it.
struct Ellipse {
  Eigen::Vector2d center;
  Eigen::Matrix2d inverse;
  Eigen::Vector2d reach;
  Eigen::Vector2d slope;  ///< m of depth per pixel
};

/// Depth over a disc that is seen from its side would change without limit.
Eigen::Vector2d SlopeOf(const Eigen::Vector3d& normal, double px_per_m) {
  constexpr double kSteepest = 3.0;
  const Eigen::Vector2d slope(-normal.x(), normal.y());
  const double scale = std::max(normal.z(), slope.norm() / kSteepest);
  return slope / (scale * px_per_m);
}

Ellipse Project(const SavedMap& map,
                std::size_t i,
                const Eigen::Matrix3d& axes,
                const Frame& f,
                const Eigen::Vector3d& mean) {
  const double u = kDiscSigmas * f.px_per_m * std::exp(map.gaussians.Column(kLogScaleU)[i]);
  const double v = kDiscSigmas * f.px_per_m * std::exp(map.gaussians.Column(kLogScaleV)[i]);
  const Eigen::Vector2d a = u * Eigen::Vector2d(axes(0, 0), -axes(1, 0));
  const Eigen::Vector2d b = v * Eigen::Vector2d(axes(0, 1), -axes(1, 1));
  const Eigen::Matrix2d shape = a * a.transpose() + b * b.transpose() +
                                kMinRadiusPx * kMinRadiusPx * Eigen::Matrix2d::Identity();
  return {f.Pixel(mean),
          shape.inverse(),
          shape.diagonal().cwiseSqrt(),
          SlopeOf(axes.col(2), f.px_per_m)};
}

void DrawDisc(const Ellipse& e, float depth, float height, float shade, Canvas& canvas) {
  const auto limit = [](double x, int size) { return std::clamp(static_cast<int>(x), 0, size); };
  const int top = limit(std::floor(e.center.y() - e.reach.y()), canvas.depth.Rows());
  const int bottom = limit(std::ceil(e.center.y() + e.reach.y()), canvas.depth.Rows());
  const int left = limit(std::floor(e.center.x() - e.reach.x()), canvas.depth.Columns());
  const int right = limit(std::ceil(e.center.x() + e.reach.x()), canvas.depth.Columns());
  for (int i = top; i < bottom; ++i) {
    for (int j = left; j < right; ++j) {
      const Eigen::Vector2d d = Eigen::Vector2d(j + 0.5, i + 0.5) - e.center;
      const float here = depth + static_cast<float>(e.slope.dot(d));
      if (here <= canvas.depth(i, j) || d.dot(e.inverse * d) > 1.0) continue;
      canvas.depth(i, j) = here;
      canvas.height(i, j) = height;
      canvas.shade(i, j) = shade;
    }
  }
}

void DrawDiscs(const SavedMap& map, const MapView& view, const Frame& frame, Canvas& canvas) {
  const Eigen::Vector3d light = Eigen::Vector3d(-0.4, 0.5, 0.8).normalized();
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const Eigen::Matrix3d axes =
        view.R_view_map * RotationOf(map.gaussians, i).cast<double>().toRotationMatrix();
    if (axes(2, 2) < -0.05) continue;  // seen from behind
    const Eigen::Vector3d in_map = MeanOf(map.gaussians, i).cast<double>();
    const Eigen::Vector3d mean = view.R_view_map * in_map;
    const double shade = 0.45 + 0.55 * std::max(0.0, axes.col(2).dot(light));
    DrawDisc(Project(map, i, axes, frame, mean),
             static_cast<float>(mean.z()),
             static_cast<float>(in_map.z()),
             static_cast<float>(shade),
             canvas);
  }
}

/// Darkens what lies behind its neighbours, so that edges show (eye-dome lighting).
double EdgeShade(const Canvas& canvas, int row, int column, double px_per_m) {
  constexpr int kReach = 2 * kOversampling;
  const float here = canvas.depth(row, column);
  double higher = 0.0;
  for (const auto& [di, dj] : {std::pair{-kReach, 0}, {kReach, 0}, {0, -kReach}, {0, kReach}}) {
    const int i = row + di;
    const int j = column + dj;
    if (i < 0 || j < 0 || i >= canvas.depth.Rows() || j >= canvas.depth.Columns()) continue;
    const float there = canvas.depth(i, j);
    if (there != kNothing) higher += std::max(0.0, static_cast<double>(there) - here);
  }
  return std::exp(-0.04 * std::min(20.0, higher * px_per_m / kOversampling));
}

Image<Rgb> Shade(const Canvas& canvas, double px_per_m) {
  Image<Rgb> picture(canvas.depth.Rows(), canvas.depth.Columns(), kNoDataColor);
  std::vector<double> heights;
  for (std::size_t i = 0; i < canvas.depth.Size(); ++i) {
    if (canvas.depth.Pixels()[i] != kNothing) {
      heights.push_back(static_cast<double>(canvas.height.Pixels()[i]));
    }
  }
  if (heights.empty()) return picture;
  const auto [low, high] = Robust(std::move(heights), 0.02);
  for (int i = 0; i < picture.Rows(); ++i) {
    for (int j = 0; j < picture.Columns(); ++j) {
      if (canvas.depth(i, j) == kNothing) continue;
      const double height = static_cast<double>(canvas.height(i, j));
      const Rgb color = RangeColor(0.12 + 0.88 * (height - low) / std::max(0.1, high - low));
      const double s = static_cast<double>(canvas.shade(i, j)) * EdgeShade(canvas, i, j, px_per_m);
      const auto dim = [&](std::uint8_t c) { return static_cast<std::uint8_t>(s * c); };
      picture(i, j) = {dim(color.r), dim(color.g), dim(color.b)};
    }
  }
  return picture;
}

void DrawDot(const Eigen::Vector2d& at, double radius, Image<Rgb>& picture) {
  for (int i = static_cast<int>(at.y() - radius); i <= at.y() + radius; ++i) {
    for (int j = static_cast<int>(at.x() - radius); j <= at.x() + radius; ++j) {
      if (i < 0 || j < 0 || i >= picture.Rows() || j >= picture.Columns()) continue;
      if ((Eigen::Vector2d(j, i) - at).norm() <= radius) picture(i, j) = kPathColor;
    }
  }
}

void DrawPath(std::span<const Eigen::Vector3d> path,
              const MapView& view,
              const Frame& frame,
              Image<Rgb>& picture) {
  constexpr double kRadius = 0.9 * kOversampling;
  constexpr double kMaxJumpPx = 1e4;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const Eigen::Vector2d to = frame.Pixel(view.R_view_map * path[k]);
    const Eigen::Vector2d from = k > 0 ? frame.Pixel(view.R_view_map * path[k - 1]) : to;
    const double length = std::min(kMaxJumpPx, (to - from).norm());
    for (double s = 0.0; s <= length; s += 1.0) {
      DrawDot(from + (to - from) * (length > 0.0 ? s / length : 0.0), kRadius, picture);
    }
  }
  if (!path.empty()) DrawDot(frame.Pixel(view.R_view_map * path.front()), 3.0 * kRadius, picture);
}

Image<Rgb> Shrink(const Image<Rgb>& large) {
  constexpr int kCells = kOversampling * kOversampling;
  Image<Rgb> small(large.Rows() / kOversampling, large.Columns() / kOversampling);
  for (int i = 0; i < small.Rows(); ++i) {
    for (int j = 0; j < small.Columns(); ++j) {
      int r = 0, g = 0, b = 0;
      for (int k = 0; k < kCells; ++k) {
        const Rgb& c =
            large(i * kOversampling + k / kOversampling, j * kOversampling + k % kOversampling);
        r += c.r;
        g += c.g;
        b += c.b;
      }
      const auto mean = [](int sum) { return static_cast<std::uint8_t>(sum / kCells); };
      small(i, j) = {mean(r), mean(g), mean(b)};
    }
  }
  return small;
}

}  // namespace

Image<Rgb> DrawMapView(const SavedMap& map,
                       std::span<const Eigen::Vector3d> path_m,
                       const MapView& view) {
  if (map.Size() == 0) return {};
  const Frame frame = FitFrame(map, path_m, view);
  Canvas canvas{Image<float>(frame.rows, frame.columns, kNothing),
                Image<float>(frame.rows, frame.columns),
                Image<float>(frame.rows, frame.columns)};
  DrawDiscs(map, view, frame, canvas);
  Image<Rgb> picture = Shade(canvas, frame.px_per_m);
  DrawPath(path_m, view, frame, picture);
  return Shrink(picture);
}

}  // namespace covsplat
