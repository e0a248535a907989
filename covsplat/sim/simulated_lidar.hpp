// A LiDAR that looks at a world while it moves.
#pragma once

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/sim/lidar_config.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/world_snapshot.hpp"

namespace covsplat {

/// One scan. Every firing is measured from the pose at its own time, within half a scan's time of
/// the stamp, in a world whose movers are where they are at that time; points are in the sensor
/// frame at that time and in order of time, columns top first, with labels. The result depends on
/// neither the pool nor other scans.
Scan SimulateScan(const World& world,
                  const Motion& motion,
                  const SimulatedLidarConfig& config,
                  int index,
                  ThreadPool& pool);

/// The scan as one instant would have seen it: every point in the sensor frame at the stamp, moved
/// with the true motion. It has no time offsets.
Scan Deskewed(const Scan& scan, const Motion& motion);

}  // namespace covsplat
