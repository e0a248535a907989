// A hall for benchmarks: a box whose sides are covered evenly by surfels, and what a sensor in it
// measures, so that every Gaussian is in view.
#pragma once

#include <cstddef>
#include <memory>

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

/// As a run makes them: once per binning.
inline constexpr int kStepsPerView = 10;

/// `rows` x 1024 pixels.
SensorModel HallSensor(int rows);

/// Where the sensor stands for the views, which take turns.
SE3 HallPose(int view);

/// An engine with that many Gaussians and the views of the hall.
std::unique_ptr<SplatEngine> MakeHall(Backend backend,
                                      const SensorModel& sensor,
                                      std::size_t gaussians,
                                      ThreadPool& pool);

/// kStepsPerView steps of the optimiser on one of the views, which take turns.
StepReport VisitHall(SplatEngine& engine, int visit);

}  // namespace covsplat
