#include "covsplat/loops/loop_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "covsplat/registration/gicp.hpp"

namespace covsplat {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// The gate becomes smaller by this with every registration.
constexpr double kNarrowing = 2.0;

GicpConfig RigidGicp(double gate_m, const LoopCheckConfig& config) {
  GicpConfig gicp;
  gicp.motion_model = MotionModel::kRigid;
  gicp.max_correspondence_m = gate_m;
  gicp.inlier_distance_m = config.inlier_distance_m;
  gicp.degeneracy_ratio = config.degeneracy_ratio;
  gicp.hold_ratio = 0.01;
  gicp.max_iterations = 30;
  return gicp;
}

AlignResult AlignMoreAndMoreClosely(const SourceCloud& source,
                                    const RegistrationTarget& target,
                                    const SE3& guess,
                                    double reach_m,
                                    const LoopCheckConfig& config,
                                    ThreadPool& pool) {
  MotionPrediction prediction;
  prediction.motion.T_map_sensor = guess;
  AlignResult align;
  for (double gate_m = std::max(reach_m, config.max_correspondence_m);;
       gate_m = std::max(gate_m / kNarrowing, config.max_correspondence_m)) {
    align = Align(source, target, prediction, RigidGicp(gate_m, config), pool);
    if (gate_m <= config.max_correspondence_m || align.iterations == 0) return align;
    prediction.motion.T_map_sensor = align.motion.T_map_sensor;
  }
}

/// Along streets and corridors there are many ways to fit halfway: of several beginnings the one
/// counts after which most overlaps.
AlignResult AlignFromAround(const SourceCloud& source,
                            const RegistrationTarget& target,
                            const SE3& guess,
                            double reach_m,
                            const LoopCheckConfig& config,
                            ThreadPool& pool) {
  std::vector<Eigen::Vector3d> offsets = {Eigen::Vector3d::Zero()};
  if (reach_m > config.max_correspondence_m) {
    for (const double sign : {0.25, -0.25}) {
      offsets.push_back(sign * reach_m * Eigen::Vector3d::UnitX());
      offsets.push_back(sign * reach_m * Eigen::Vector3d::UnitY());
    }
  }
  AlignResult best;
  for (const Eigen::Vector3d& offset : offsets) {
    const SE3 begin = guess * SE3(Eigen::Quaterniond::Identity(), offset);
    AlignResult align = AlignMoreAndMoreClosely(
        source, target, begin, std::max(0.5 * reach_m, config.max_correspondence_m), config, pool);
    if (offset.isZero() || align.inlier_ratio > best.inlier_ratio) best = std::move(align);
  }
  return best;
}

/// That of the registration less what it does not hold, and no more than the configured deviations
/// allow: (I^-1 + S)^-1, which is written so that I need not have an inverse.
Matrix6d InformationOf(const AlignResult& align, const LoopCheckConfig& config) {
  const Matrix6d measured = WithoutDirections(align.information, align.weak);
  const double rad = std::max(config.sigma_deg * kDegree, 1e-6);
  const double m = std::max(config.sigma_m, 1e-6);
  Vector6d most;
  most << Eigen::Vector3d::Constant(1.0 / (rad * rad)), Eigen::Vector3d::Constant(1.0 / (m * m));
  Matrix6d sum = measured;
  sum.diagonal() += most;
  const Matrix6d information = measured - measured * sum.ldlt().solve(measured);
  return 0.5 * (information + information.transpose());
}

LoopFate FateOf(const LoopCheck& check, const WeakDirections& weak, const LoopCheckConfig& config) {
  if (check.overlap < config.min_overlap) return LoopFate::kLittleOverlap;
  if (check.rms_m > config.max_rms_m) return LoopFate::kPoorFit;
  if (check.seen_through > config.max_seen_through) return LoopFate::kSeenThrough;
  if (!weak.translations.empty()) return LoopFate::kDegenerate;
  return LoopFate::kAlone;
}

}  // namespace

LoopCheck CheckLoop(const LocalMap& fresh,
                    const LocalMap& old,
                    const SE3& T_old_new_guess,
                    double reach_m,
                    const LoopCheckConfig& config,
                    ThreadPool& pool) {
  const SourceCloud source = SourceOf(fresh, config.voxel_m);
  const RegistrationTarget target = TargetOf(old, config.voxel_m);
  const AlignResult align = AlignFromAround(source, target, T_old_new_guess, reach_m, config, pool);
  LoopCheck check;
  check.T_old_new = align.motion.T_map_sensor;
  if (align.correspondences == 0) return check;
  check.information = InformationOf(align, config);
  check.overlap = align.inlier_ratio;
  check.rms_m = align.rms_residual_m;
  check.seen_through = std::max(SeenThroughShare(fresh, old, check.T_old_new),
                                SeenThroughShare(old, fresh, check.T_old_new.Inverse()));
  check.fate = FateOf(check, align.weak, config);
  return check;
}

}  // namespace covsplat
