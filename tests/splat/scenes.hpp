// Small scenes of Gaussians for the rasteriser's tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

/// Which row of the old table each of the new one is; padding counts as where it is.
inline std::vector<std::size_t> OldRows(const RowMoves& moves) {
  std::vector<std::size_t> old_row(moves.size);
  std::iota(old_row.begin(), old_row.end(), std::size_t{0});
  for (const RowRun& run : moves.runs) {
    for (std::size_t k = 0; k < run.count; ++k) old_row[run.to + k] = run.from + k;
  }
  return old_row;
}

/// A small sensor with uneven beams, so that the row table has real slopes.
inline SensorModel SmallSensor(int columns = 64) {
  std::vector<double> elevation_rad;
  double elevation = 0.35;
  for (int i = 0; i < 18; ++i) {
    elevation_rad.push_back(elevation);
    elevation -= 0.03 + 0.001 * i;
  }
  return {elevation_rad, columns, 0.5, 30.0};
}

template <class S>
void SetGaussian(GaussianColumns<S>& table,
                 std::size_t i,
                 const Eigen::Vector3d& mean,
                 const Eigen::Quaterniond& q,
                 double scale_u,
                 double scale_v,
                 double opacity) {
  const Eigen::Vector2d log_scale(std::log(scale_u), std::log(scale_v));
  WriteGaussian(table,
                i,
                mean.cast<S>(),
                q.cast<S>(),
                log_scale.cast<S>(),
                static_cast<S>(std::log(opacity / (1.0 - opacity))));
}

/// Gaussians of random pose and size in front of azimuth `centre_rad`, facing the origin; the
/// smallest are far below a pixel, so that the screen-space filter decides for them.
template <class S>
GaussianColumns<S> RandomGaussians(std::size_t count, double centre_rad, std::uint64_t seed) {
  GaussianColumns<S> table;
  table.Resize(count);
  Rng rng(seed);
  for (std::size_t i = 0; i < count; ++i) {
    const double az = centre_rad + rng.Uniform(-0.5, 0.5);
    const double el = rng.Uniform(-0.25, 0.3);
    const double range = rng.Uniform(3.0, 8.0);
    const Eigen::Vector3d ray(
        std::cos(az) * std::cos(el), std::sin(az) * std::cos(el), std::sin(el));
    const Eigen::Vector3d tilt(rng.Normal(), rng.Normal(), rng.Normal());
    const Eigen::Vector3d normal = (-ray + 0.35 * tilt).normalized();
    Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    q = q * Eigen::AngleAxisd(rng.Uniform(0.0, 6.0), Eigen::Vector3d::UnitZ());
    const double size = rng.Uniform() < 0.3 ? 0.05 : 0.5;
    SetGaussian(table,
                i,
                range * ray,
                q,
                size * rng.Uniform(0.5, 1.5),
                size * rng.Uniform(0.5, 1.5),
                rng.Uniform(0.2, 0.9));
  }
  return table;
}

template <class To, class From>
GaussianColumns<To> Convert(const GaussianColumns<From>& from) {
  GaussianColumns<To> to;
  to.Resize(from.Size());
  for (int p = 0; p < kParameterCount; ++p) {
    for (std::size_t i = 0; i < from.Size(); ++i) {
      to.Column(p)[i] = static_cast<To>(from.Column(p)[i]);
    }
  }
  return to;
}

/// As RandomGaussians, but five of them cannot be drawn.
inline GaussianColumns<float> BrokenGaussians() {
  GaussianColumns<float> table = RandomGaussians<float>(48, 0.0, 13);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  table.Column(kMeanX)[3] = nan;
  table.Column(kQuatW)[7] = nan;
  table.Column(kOpacityLogit)[9] = nan;
  table.Column(kLogScaleU)[11] = nan;
  for (int p = kQuatW; p <= kQuatZ; ++p) table.Column(p)[15] = 0.0f;
  return table;
}

inline SensorModel RoomSensor() { return UniformSensorModel(32, 256, -0.4, 0.4, 0.5, 30.0); }

/// A room of 10 x 8 m seen from its middle.
inline RangeMeasurement RoomMeasurement(const SensorModel& sensor) {
  RangeMeasurement m{
      Image<float>(sensor.Rows(), sensor.Columns(), 0.0f),
      Image<Eigen::Vector3f>(sensor.Rows(), sensor.Columns(), Eigen::Vector3f::Zero())};
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const Eigen::Vector3f ray = sensor.RayOf(row, column);
      const float tx = 5.0f / std::max(std::abs(ray.x()), 1e-6f);
      const float ty = 4.0f / std::max(std::abs(ray.y()), 1e-6f);
      m.range_m(row, column) = std::min(tx, ty);
      m.normal(row, column) = tx < ty ? Eigen::Vector3f(ray.x() < 0 ? 1.0f : -1.0f, 0.0f, 0.0f)
                                      : Eigen::Vector3f(0.0f, ray.y() < 0 ? 1.0f : -1.0f, 0.0f);
    }
  }
  return m;
}

/// Surfels on the room's walls, displaced and tilted by noise.
inline GaussianColumns<float> NoisyRoom(const SensorModel& sensor, const RangeMeasurement& m) {
  GaussianColumns<float> table;
  table.Resize(static_cast<std::size_t>(sensor.Rows() * sensor.Columns() / 4));
  Rng rng(3);
  std::size_t i = 0;
  for (int row = 0; row < sensor.Rows(); row += 2) {
    for (int column = 0; column < sensor.Columns(); column += 2) {
      const Eigen::Vector3d tilt(rng.Normal(), rng.Normal(), rng.Normal());
      const Eigen::Vector3d normal =
          (m.normal(row, column).cast<double>() + 0.15 * tilt).normalized();
      const double range = m.range_m(row, column) + 0.05 * rng.Normal();
      const Eigen::Vector3d mean = range * sensor.RayOf(row, column).cast<double>();
      const Eigen::Quaterniond q =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
      SetGaussian(table, i++, mean, q, 0.1, 0.1, 0.5);
    }
  }
  return table;
}

/// An engine for the room's sensor renders the same from an anchor, wherever that is moved.
inline void ExpectAMovedAnchorTakesItsGaussiansAlong(SplatEngine& engine) {
  engine.AddAnchor(SE3());
  engine.Append(0, NoisyRoom(RoomSensor(), RoomMeasurement(RoomSensor())));
  const RenderOutput before = engine.Render(SE3());
  const SE3 moved = SE3::Exp((Vector6d() << 0.3, -0.2, 1.0, 100.0, 50.0, -3.0).finished());
  engine.SetAnchorPose(0, moved);
  const RenderOutput after = engine.Render(moved);
  for (std::size_t i = 0; i < before.range_m.Size(); ++i) {
    ASSERT_NEAR(before.range_m.Pixels()[i], after.range_m.Pixels()[i], 1e-3f);
  }
}

}  // namespace covsplat
