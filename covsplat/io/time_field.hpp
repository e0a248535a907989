// Times of points as the drivers write them: many names, four units, relative or absolute.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/result.hpp"
#include "covsplat/io/point_table.hpp"

namespace covsplat {

struct PointTimes {
  std::optional<double> stamp_s;  ///< of the first measurement, if the values are absolute times
  std::vector<float> offset_s;    ///< [N], or empty if all points have one and the same time
};

/// The column that holds the times of the points, told by its name, or null.
const PointColumn* FindTimeColumn(const PointTable& table);

/// True for points that a driver did not put there only to fill a grid: finite, not the origin.
bool IsMeasured(const Eigen::Vector3f& point);

/// Offsets in seconds. The unit is told from the span of the values over the measured points, as a
/// scan lasts 0.02 to 0.5 s, because drivers use one name for seconds and for nanoseconds. Values
/// beyond a second are absolute; the earliest becomes the stamp. Values of points that were not
/// measured are limited to the span of the others. A span that fits no unit is an error that shows
/// the numbers; `where` names the file and column.
Result<PointTimes> DecodePointTimes(std::span<const double> values,
                                    std::span<const Eigen::Vector3f> points,
                                    const std::string& where);

}  // namespace covsplat
