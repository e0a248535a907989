#include "covsplat/sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "covsplat/core/check.hpp"
#include "covsplat/sim/worlds.hpp"

namespace covsplat {

namespace {

// What there is to look at, and the way through it, if it has one of its own.
struct Place {
  WorldMesh mesh;
  std::vector<Mover> movers;
  std::optional<Route> route;
  std::string_view default_motion = "walking";
};

Result<Place> FindPlace(const SimulationConfig& config) {
  if (IsMeshFile(config.world)) {
    Result<WorldMesh> mesh = LoadUserMesh(config.world, config.mesh);
    if (!mesh) return Forward(mesh);
    return Place{std::move(*mesh), {}, {}};
  }
  const Result<WorldKind> world = FindWorld(config.world);
  if (!world) return Forward(world);
  return Place{
      world->mesh(config.seed), world->movers(config.seed), world->route(), world->default_motion};
}

Result<Motion> FindMotion(const SimulationConfig& config, const Place& place) {
  if (!config.route.file.empty()) {
    if (config.motion.empty() && config.laps == 1) return LoadUserMotion(config.route);
    return Fail(ErrorCode::kUsage,
                "{}: its poses are the motion; leave out --motion and --laps",
                config.route.file);
  }
  std::optional<Route> route = place.route;
  if (!config.route.points_m.empty()) {
    Result<Route> own = UserRoute(config.route);
    if (!own) return Forward(own);
    route = std::move(*own);
  }
  if (!route) {
    return Fail(ErrorCode::kUsage,
                "{}: say which way the sensor moves in it: --path FILE with its poses, or "
                "-s route.points_m=[x,y,z,...] with the corners of a way",
                config.world);
  }
  const std::string_view name =
      config.motion.empty() ? place.default_motion : std::string_view(config.motion);
  return MakeMotion(name, *route, config.laps, config.seed);
}

}  // namespace

Result<Simulation> Simulation::Create(const SimulationConfig& config) {
  const Result<void> possible = CheckLidar(config.lidar);
  if (!possible) return Forward(possible);
  Result<Place> place = FindPlace(config);
  if (!place) return Forward(place);
  Result<Motion> motion = FindMotion(config, *place);
  if (!motion) return Forward(motion);
  std::vector<std::string> warnings;
  if (!place->route) warnings = DoubtsAbout(config.world, place->mesh, *motion);
  Simulation simulation(
      config, Scene(std::move(place->mesh)), std::move(place->movers), std::move(*motion));
  simulation.warnings_ = std::move(warnings);
  if (simulation.ScanCount() > 0) return simulation;
  return Fail(ErrorCode::kUsage,
              "the motion takes {:.3f} s, which is less than one scan",
              simulation.motion_.Duration());
}

Simulation::Simulation(SimulationConfig config,
                       Scene scene,
                       std::vector<Mover> movers,
                       Motion motion)
    : config_(std::move(config)),
      scene_(std::move(scene)),
      movers_(std::move(movers)),
      motion_(std::move(motion)) {
  scan_count_ = static_cast<int>(motion_.Duration() * config_.lidar.scan_rate_hz);
  if (config_.max_scans > 0) scan_count_ = std::min(scan_count_, config_.max_scans);
}

Scan Simulation::MakeScan(int index, ThreadPool& pool) const {
  COVSPLAT_CHECK(index >= 0 && index < scan_count_);
  return SimulateScan({scene_, movers_}, motion_, config_.lidar, index, pool);
}

SE3 Simulation::PoseOf(int index) const { return motion_.PoseAt(StampOf(config_.lidar, index)); }

Trajectory Simulation::Truth(double rate_hz) const {
  const SimulatedLidarConfig& lidar = config_.lidar;
  const double turn_s = 1.0 / lidar.scan_rate_hz;
  const auto samples = static_cast<int>(std::ceil((scan_count_ + 2) * turn_s * rate_hz));
  std::vector<double> stamps;
  for (int i = 0; i < scan_count_; ++i) stamps.push_back(StampOf(lidar, i));
  for (int i = 0; i <= samples; ++i) {
    // A sample that is a scan's stamp but for rounding becomes it.
    constexpr double kSameTimeS = 1e-7;
    const double sample_s = i / rate_hz - turn_s;
    const double nearest_s =
        StampOf(lidar, static_cast<int>(std::floor(sample_s * lidar.scan_rate_hz)));
    stamps.push_back(std::abs(sample_s - nearest_s) < kSameTimeS ? nearest_s : sample_s);
  }
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  Trajectory truth;
  truth.reserve(stamps.size());
  for (const double stamp_s : stamps) truth.push_back({stamp_s, motion_.PoseAt(stamp_s)});
  return truth;
}

}  // namespace covsplat
