#include "bench/hall.hpp"

#include <cmath>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

constexpr int kViews = 4;
const Eigen::Vector3d kHalfHall(15.0, 10.0, 3.0);

/// What the sensor measures in the hall from one of the poses.
RangeMeasurement Measure(const SensorModel& sensor, int view) {
  const Eigen::Vector3d from = HallPose(view).Translation();
  const int rows = sensor.Rows();
  const int columns = sensor.Columns();
  RangeMeasurement m{Image<float>(rows, columns, 0.0f),
                     Image<Eigen::Vector3f>(rows, columns, Eigen::Vector3f::Zero())};
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector3d ray = sensor.RayOf(row, column).cast<double>();
      double nearest = 1e9;
      for (int axis = 0; axis < 3; ++axis) {
        const double side = ray[axis] < 0.0 ? -1.0 : 1.0;
        const double t = (side * kHalfHall[axis] - from[axis]) / (ray[axis] + side * 1e-9);
        if (t >= nearest) continue;
        nearest = t;
        m.normal(row, column) = static_cast<float>(-side) * Eigen::Vector3f::Unit(axis);
      }
      m.range_m(row, column) = static_cast<float>(nearest);
    }
  }
  return m;
}

/// Surfels spread evenly over the hall's six sides, a little off, in the map's frame.
GaussianColumns<float> Cover(std::size_t count) {
  const Eigen::Vector3d side = 2.0 * kHalfHall;
  const Eigen::Vector3d area(side.y() * side.z(), side.x() * side.z(), side.x() * side.y());
  const double scale = 0.6 * std::sqrt(2.0 * area.sum() / static_cast<double>(count));
  const auto log_scale = Eigen::Vector2f::Constant(static_cast<float>(std::log(scale)));
  GaussianColumns<float> table;
  table.Resize(count);
  Rng rng(1);
  for (std::size_t i = 0; i < count; ++i) {
    const double pick = rng.Uniform() * area.sum();
    const int axis = pick < area.x() ? 0 : pick < area.x() + area.y() ? 1 : 2;
    const double sign = rng.Uniform() < 0.5 ? -1.0 : 1.0;
    Eigen::Vector3d mean;
    for (int k = 0; k < 3; ++k) mean[k] = kHalfHall[k] * rng.Uniform(-1.0, 1.0);
    mean[axis] = sign * kHalfHall[axis] + 0.02 * rng.Normal();
    const Eigen::Vector3d tilt(rng.Normal(), rng.Normal(), rng.Normal());
    const Eigen::Vector3d normal = (0.1 * tilt - sign * Eigen::Vector3d::Unit(axis)).normalized();
    const auto q = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    WriteGaussian(table, i, mean.cast<float>(), q.cast<float>(), log_scale, 1.5f);
  }
  return table;
}

}  // namespace

SensorModel HallSensor(int rows) { return UniformSensorModel(rows, 1024, -0.39, 0.39, 0.5, 60.0); }

SE3 HallPose(int view) {
  const int place = view % kViews;
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(2.0 * place - 3.0, 0.5 * place, 0.0)};
}

std::unique_ptr<SplatEngine> MakeHall(Backend backend,
                                      const SensorModel& sensor,
                                      std::size_t gaussians,
                                      ThreadPool& pool) {
  auto engine = MakeSplatEngine(backend, sensor, {}, pool).value();
  const int map = engine->AddAnchor(SE3());
  engine->Append(map, Cover(gaussians));
  for (int view = 0; view < kViews; ++view) {
    engine->SetView(engine->AddAnchor(HallPose(view)), Measure(sensor, view));
  }
  return engine;
}

StepReport VisitHall(SplatEngine& engine, int visit) {
  StepReport report;
  for (int i = 0; i < kStepsPerView; ++i) report = engine.Step(1 + visit % kViews, true);
  return report;
}

}  // namespace covsplat
