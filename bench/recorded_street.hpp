// The work of one mapping iteration in a real street: surfels of a few scans of a KITTI drive, and
// the view of the scan in their middle. As dense and as deep as what a run optimises, unlike the
// even hall of splat_bench.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/sensor_model.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

class RecordedStreet {
 public:
  /// Reads scans 54 to 66, every third, of `kitti_raw_0005` in $COVSPLAT_DATA (default:
  /// ../shared/data beside the sources). Nothing if they are not there.
  static std::optional<RecordedStreet> Load();

  /// 64 x 1024 pixels over +2 to -24.8 degrees.
  const SensorModel& Sensor() const { return sensor_; }
  /// Scan 60, with normals from the ten nearest points.
  const RangeMeasurement& Measurement() const { return measurement_; }

  /// Surfels on `count` points drawn at random, in the frame of scan 60 and facing it, in the order
  /// of its image. Their larger standard deviation is `footprint` times half the mean distance to
  /// the four nearest surfels, within 5 mm to 1 m; the other is 0.6 to 1 of it; opacities are 0.55
  /// to 0.9. The same surfels every time.
  GaussianColumns<float> Surfels(std::size_t count, double footprint) const;

 private:
  RecordedStreet(std::vector<Eigen::Vector3f> points, std::vector<Eigen::Vector3f> view_points);

  SensorModel sensor_;
  std::vector<Eigen::Vector3f> points_;  ///< of all scans that are in view, frame of scan 60
  RangeMeasurement measurement_;
};

}  // namespace covsplat
