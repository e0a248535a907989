// Sums over matches of a scan's points with surfels, 16 at a time. Internal to the module.
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

#include "covsplat/registration/target.hpp"

namespace covsplat {

/// What matching needs to know of a source point; one cache line.
struct alignas(64) SourceRecord {
  Eigen::Vector3f point;  ///< sensor frame at the point's time
  float phase;
  Eigen::Matrix<float, 6, 1> covariance;  ///< as that of a surfel, sensor frame at the point's time
  Eigen::Vector3f normal;                 ///< of unit length, likewise
};

static_assert(sizeof(SourceRecord) == 64 && sizeof(RegistrationTarget::Record) == 64);

/// Matches that wait to be summed up, as tables whose rows are 16 numbers.
class MatchBatch {
 public:
  static constexpr std::size_t kSize = 16;

  /// `pose`: takes the point to the axes of the map, about the sensor at mid scan. The batch must
  /// not be full.
  void Add(std::size_t index,
           const SourceRecord& source,
           const RegistrationTarget::Record& surfel,
           const Eigen::Matrix4f& pose) {
    source_[count_] = source;
    surfel_[count_] = surfel;
    pose_[count_] = pose;
    index_[count_++] = index;
  }
  void Clear() { count_ = 0; }
  /// Repeats the last match in the rows that are left, so that all hold numbers that can be
  /// calculated with.
  void FillUp() {
    for (std::size_t k = count_; k < kSize && count_ > 0; ++k) {
      source_[k] = source_[count_ - 1];
      surfel_[k] = surfel_[count_ - 1];
      pose_[k] = pose_[count_ - 1];
    }
  }

  std::size_t Size() const { return count_; }
  bool IsFull() const { return count_ == kSize; }
  std::size_t IndexOf(std::size_t match) const { return index_[match]; }
  const float* Sources() const { return source_.front().point.data(); }
  const float* Surfels() const { return surfel_.front().mean.data(); }
  const float* Poses() const { return pose_.front().data(); }

 private:
  std::array<SourceRecord, kSize> source_;
  std::array<RegistrationTarget::Record, kSize> surfel_;
  alignas(64) std::array<Eigen::Matrix4f, kSize> pose_;
  std::array<std::size_t, kSize> index_ = {};
  std::size_t count_ = 0;
};

struct MatchSettings {
  Eigen::Vector3f sensor;  ///< position at mid scan relative to the target's origin
  float inverse_kernel_scale;
  float inlier_distance_m;
  bool same_side;  ///< pairs that face opposite ways are no matches
};

/// Sums of the matches that are in one lane of the batches; what they are is said at PhaseMoments.
struct MatchSums {
  static constexpr int kMoments = 5;
  static constexpr int kTerms = 27;
  static constexpr int kLeverTerms = 10;
  using Lanes = std::array<float, MatchBatch::kSize>;

  alignas(64) std::array<std::array<Lanes, kTerms>, kMoments> moment = {};
  alignas(64) std::array<Lanes, kLeverTerms> lever = {};
  alignas(64) Lanes weighted_square = {};
  alignas(64) Lanes kernel_sum = {};
  alignas(64) Lanes kernel_square_sum = {};
  alignas(64) Lanes plane_square = {};
  alignas(64) Lanes matches = {};
  alignas(64) Lanes inliers = {};
};

/// Adds a batch, which has been filled up, to the sums. `mahalanobis`: e^T M e of each, infinite if
/// it is no match.
void SumMatches(const MatchBatch& batch,
                const MatchSettings& settings,
                MatchSums& sums,
                MatchSums::Lanes& mahalanobis);

}  // namespace covsplat
