#include "covsplat/mapping/plane_cover.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "covsplat/registration/symmetric_eigen.hpp"
#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {
namespace {

/// Half the side of an evenly filled square, in its standard deviations.
constexpr double kEdgeSigmas = std::numbers::sqrt3;
/// A little beyond its sides a Gaussian still shows what it covers.
constexpr double kMargin = 1.1;

/// An evenly filled, flat piece of surface: a Gaussian, or several together.
struct Piece {
  Eigen::Vector3d mean;
  Eigen::Matrix3d axes;      ///< columns: descending variance; the last is the normal
  Eigen::Vector3d variance;  ///< descending, the last what its members lie beside their plane
  double area_m2;            ///< of what is covered, not counted twice
  double log_clear;          ///< mean logarithm of the light that passes
  Eigen::Vector2d expansion = Eigen::Vector2d::Ones();  ///< of the axes, to cover the members
  std::vector<std::size_t> members;

  Eigen::Matrix3d Covariance() const { return axes * variance.asDiagonal() * axes.transpose(); }
  double FullArea() const {
    return 4.0 * kEdgeSigmas * kEdgeSigmas * std::sqrt(variance[0] * variance[1]);
  }
  /// The longer standard deviation, with all members covered.
  double Reach() const { return variance.head<2>().cwiseSqrt().cwiseProduct(expansion).maxCoeff(); }
  double Weight() const { return area_m2 * -std::expm1(log_clear); }
};

/// What all pieces have in common.
struct CoverJob {
  std::span<const PlanarGaussian> gaussians;
  double extent_factor;
  const PlaneCoverConfig* config;
  double min_cosine;
};

Piece PieceOf(const PlanarGaussian& gaussian, std::size_t index, double extent_factor) {
  constexpr double kMaxOpacity = 0.999;
  Eigen::Vector3d u = gaussian.disc.u.cast<double>() / extent_factor;
  Eigen::Vector3d v = gaussian.disc.v.cast<double>() / extent_factor;
  const Eigen::Vector3d normal = u.cross(v).normalized();
  if (v.squaredNorm() > u.squaredNorm()) std::swap(u, v);
  Piece piece;
  piece.mean = gaussian.disc.mean.cast<double>();
  piece.axes << u.normalized(), normal.cross(u.normalized()), normal;
  piece.variance = {u.squaredNorm(), v.squaredNorm(), 0.0};
  piece.area_m2 = piece.FullArea();
  piece.log_clear = std::log1p(-std::min<double>(gaussian.opacity, kMaxOpacity));
  piece.members = {index};
  return piece;
}

/// A distance with the area that is so far away.
using Weighted = std::pair<double, double>;

/// The distance within which a share of the area lies.
double ShareWithin(std::vector<Weighted>& distances, double share) {
  std::ranges::sort(distances);
  double left = 0.0;
  for (const auto& [distance, area] : distances) left += share * area;
  for (const auto& [distance, area] : distances) {
    left -= area;
    if (left <= 0.0) return distance;
  }
  return distances.back().first;
}

/// How much longer a piece's axes have to be to cover the share of its members, nine places of
/// each, that the configuration asks for.
Eigen::Vector2d ExpansionOf(const Piece& piece, const CoverJob& job) {
  constexpr int kPlaces = 9;
  const double step = 0.8 * kEdgeSigmas / job.extent_factor;
  const Eigen::Vector2d reach = kMargin * kEdgeSigmas * piece.variance.head<2>().cwiseSqrt();
  std::array<std::vector<Weighted>, 2> distances;
  for (const std::size_t i : piece.members) {
    const Disc& disc = job.gaussians[i].disc;
    const double area = static_cast<double>(disc.u.norm()) * disc.v.norm();
    for (int k = 0; k < kPlaces; ++k) {
      const int along_u = k % 3 - 1;
      const int along_v = k / 3 - 1;
      const Eigen::Vector3d place = disc.mean.cast<double>() +
                                    step * along_u * disc.u.cast<double>() +
                                    step * along_v * disc.v.cast<double>();
      const Eigen::Vector2d at = piece.axes.leftCols<2>().transpose() * (place - piece.mean);
      for (int axis = 0; axis < 2; ++axis) {
        distances[static_cast<std::size_t>(axis)].emplace_back(std::abs(at[axis]) / reach[axis],
                                                               area);
      }
    }
  }
  const double share = 0.5 * (1.0 + job.config->cover);  // both axes may leave out as much
  return {std::max(1.0, ShareWithin(distances[0], share)),
          std::max(1.0, ShareWithin(distances[1], share))};
}

/// How long the longer standard deviation of two pieces together may be. If both are longer than
/// what is wanted, they lie upon each other if they are no longer together.
double MaxReach(const Piece& a, const Piece& b, const CoverJob& job) {
  const double wanted_m = job.config->max_scale_m / job.extent_factor;
  return std::min(a.Reach(), b.Reach()) > wanted_m ? std::max(a.Reach(), b.Reach()) : wanted_m;
}

/// Both pieces as one, if it is flat, small enough, and filled.
std::optional<Piece> Joined(const Piece& a, const Piece& b, const CoverJob& job) {
  const PlaneCoverConfig& config = *job.config;
  const double area = a.area_m2 + b.area_m2;
  const double share_a = a.area_m2 / area;
  const double share_b = b.area_m2 / area;
  const Eigen::Vector3d between = b.mean - a.mean;
  const SymmetricEigen eigen =
      DecomposeSymmetric(share_a * a.Covariance() + share_b * b.Covariance() +
                         share_a * share_b * between * between.transpose());
  Piece joined;
  joined.mean = a.mean + share_b * between;
  joined.axes = eigen.vectors;
  joined.variance = eigen.values.cwiseMax(0.0);
  const double max_sigma_m = MaxReach(a, b, job);
  const bool may_fit = joined.variance[2] <= config.flatness_m * config.flatness_m &&
                       joined.variance[0] <= max_sigma_m * max_sigma_m &&
                       area >= config.fill * joined.FullArea();
  if (!may_fit) return std::nullopt;
  if (joined.axes.col(2).dot(a.axes.col(2)) < 0.0) joined.axes.rightCols<2>() *= -1.0;
  joined.area_m2 = std::min(area, joined.FullArea());
  joined.log_clear = (a.area_m2 * a.log_clear + b.area_m2 * b.log_clear) / joined.area_m2;
  joined.members = a.members;
  joined.members.insert(joined.members.end(), b.members.begin(), b.members.end());
  joined.expansion = ExpansionOf(joined, job);
  const bool fits = joined.Reach() <= max_sigma_m &&
                    area >= config.fill * joined.expansion.prod() * joined.FullArea();
  return fits ? std::optional(std::move(joined)) : std::nullopt;
}

/// Whether pieces that touch could lie in one plane.
bool MayJoin(const Piece& a, const Piece& b, const CoverJob& job) {
  constexpr double kMaxOffsets = 4.0;
  if (a.axes.col(2).dot(b.axes.col(2)) < job.min_cosine) return false;
  const double offset_m = std::abs(a.axes.col(2).dot(b.mean - a.mean));
  return offset_m <= kMaxOffsets * job.config->flatness_m;
}

/// A piece that takes the place of others.
struct Joint {
  Piece piece;
  std::vector<std::size_t> pieces;  ///< it was made of, the representative first
};

/// The representative with all that can be joined to it, nearest first.
Joint Grow(std::size_t representative,
           std::span<const std::size_t> others,
           const std::vector<Piece>& pieces,
           const CoverJob& job) {
  Joint joint{pieces[representative], {representative}};
  std::vector<std::pair<double, std::size_t>> left;
  for (const std::size_t i : others) {
    if (!MayJoin(joint.piece, pieces[i], job)) continue;
    left.emplace_back((pieces[i].mean - joint.piece.mean).squaredNorm(), i);
  }
  std::ranges::sort(left);
  // What does not fit beside a part of the others may well fit beside all.
  for (bool grows = true; grows && !left.empty();) {
    grows = false;
    std::erase_if(left, [&](const auto& candidate) {
      std::optional<Piece> joined = Joined(joint.piece, pieces[candidate.second], job);
      if (!joined) return false;
      joint.piece = std::move(*joined);
      joint.pieces.push_back(candidate.second);
      return grows = true;
    });
  }
  return joint;
}

/// All joints within a cell; the piece that shows most stands for those that join it.
void JoinWithin(std::vector<std::size_t> cell,
                const std::vector<Piece>& pieces,
                const CoverJob& job,
                std::vector<Joint>& joints) {
  std::ranges::stable_sort(
      cell, [&](std::size_t a, std::size_t b) { return pieces[a].Weight() > pieces[b].Weight(); });
  while (cell.size() > 1) {
    Joint joint = Grow(cell.front(), std::span(cell).subspan(1), pieces, job);
    std::erase_if(cell, [&](std::size_t i) {
      return std::ranges::find(joint.pieces, i) != joint.pieces.end();
    });
    if (joint.pieces.size() > 1) joints.push_back(std::move(joint));
  }
}

std::vector<std::vector<std::size_t>> CellsOf(const std::vector<Piece>& pieces,
                                              double cell_m,
                                              double shift) {
  VoxelHash cell_of;
  std::vector<std::vector<std::size_t>> cells;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Eigen::Vector3f at = (pieces[i].mean / cell_m).cast<float>();
    const int fresh = static_cast<int>(cells.size());
    const int cell = cell_of.FindOrInsert(CellOf((at.array() + static_cast<float>(shift))), fresh);
    if (cell == fresh) cells.emplace_back();
    cells[static_cast<std::size_t>(cell)].push_back(i);
  }
  return cells;
}

/// Puts the joints that spare most in the place of what they were made of.
std::vector<Piece> Replaced(std::vector<Piece> pieces,
                            std::vector<Joint> joints,
                            std::size_t max_removed) {
  std::ranges::stable_sort(
      joints, [](const Joint& a, const Joint& b) { return a.pieces.size() > b.pieces.size(); });
  std::vector<std::uint8_t> gone(pieces.size(), 0);
  std::size_t removed = 0;
  for (Joint& joint : joints) {
    const std::size_t removes = joint.pieces.size() - 1;
    if (removed + removes > max_removed) continue;
    removed += removes;
    for (const std::size_t i : joint.pieces) gone[i] = 1;
    gone[joint.pieces.front()] = 0;
    pieces[joint.pieces.front()] = std::move(joint.piece);
  }
  std::vector<Piece> left;
  left.reserve(pieces.size() - removed);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (gone[i] == 0) left.push_back(std::move(pieces[i]));
  }
  return left;
}

PlaneCover CoverOf(Piece piece, double extent_factor) {
  const Eigen::Vector2d scale_m =
      extent_factor * piece.variance.head<2>().cwiseSqrt().cwiseProduct(piece.expansion);
  PlaneCover cover;
  cover.members = std::move(piece.members);
  std::ranges::sort(cover.members);
  cover.disc.mean = piece.mean.cast<float>();
  cover.disc.u = (scale_m[0] * piece.axes.col(0)).cast<float>();
  cover.disc.v = (scale_m[1] * piece.axes.col(1)).cast<float>();
  cover.opacity = static_cast<float>(-std::expm1(piece.log_clear));
  return cover;
}

}  // namespace

std::vector<PlaneCover> CoverPlanes(std::span<const PlanarGaussian> gaussians,
                                    double extent_factor,
                                    const PlaneCoverConfig& config) {
  const double max_angle_rad = config.max_angle_deg * std::numbers::pi / 180.0;
  const CoverJob job{gaussians, extent_factor, &config, std::cos(max_angle_rad)};
  std::vector<Piece> pieces;
  pieces.reserve(gaussians.size());
  for (std::size_t i = 0; i < gaussians.size(); ++i) {
    pieces.push_back(PieceOf(gaussians[i], i, extent_factor));
  }
  const auto max_removed =
      static_cast<std::size_t>(config.max_share * static_cast<double>(gaussians.size()));
  for (int pass = 0; pass < config.passes; ++pass) {
    const double cell_m = std::ldexp(config.cell_m, pass + 1 - config.passes);
    // Borders of cells move from pass to pass, so that none of them stays one.
    const double shift = pass % 2 == 0 ? 0.0 : 0.5;
    std::vector<Joint> joints;
    for (std::vector<std::size_t>& cell : CellsOf(pieces, cell_m, shift)) {
      JoinWithin(std::move(cell), pieces, job, joints);
    }
    pieces = Replaced(std::move(pieces), std::move(joints), max_removed);
  }
  std::vector<PlaneCover> covers;
  for (Piece& piece : pieces) {
    if (piece.members.size() > 1) covers.push_back(CoverOf(std::move(piece), extent_factor));
  }
  return covers;
}

}  // namespace covsplat
