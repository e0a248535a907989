// The map's primitives: flat 2D Gaussians (surfels) stored one column per parameter.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "covsplat/core/aligned_vector.hpp"
#include "covsplat/splat/parameters.hpp"

namespace covsplat {

/// Without the half that vectors leave free at worst when they grow: tables are large.
template <class T, class Allocator>
void ResizeTightly(std::vector<T, Allocator>& values, std::size_t size) {
  if (size > values.capacity()) values.reserve(size + size / 8);
  values.resize(size);
}

/// Value i becomes what value old_row[i] was; what stays where it is costs nothing.
template <class T, class Allocator>
void GatherRows(std::span<const std::size_t> old_row, std::vector<T, Allocator>& values) {
  std::size_t same = 0;
  while (same < old_row.size() && old_row[same] == same) ++same;
  std::vector<T> moved;
  moved.reserve(old_row.size() - same);
  for (const std::size_t i : old_row.subspan(same)) moved.push_back(values[i]);
  values.resize(same);
  values.insert(values.end(), moved.begin(), moved.end());
}

/// Equally long columns, each followed by kBlockSize readable values.
template <class S, int kColumns>
class ColumnTable {
 public:
  std::size_t Size() const { return size_; }

  void Resize(std::size_t size) {
    size_ = size;
    for (auto& column : columns_) ResizeTightly(column, size + kBlockSize);
  }

  S* Column(int column) { return columns_[static_cast<std::size_t>(column)].data(); }
  const S* Column(int column) const { return columns_[static_cast<std::size_t>(column)].data(); }

  /// Row i becomes what row old_row[i] was.
  void Gather(std::span<const std::size_t> old_row) {
    for (auto& column : columns_) {
      GatherRows(old_row, column);
      ResizeTightly(column, old_row.size() + kBlockSize);
    }
    size_ = old_row.size();
  }

 private:
  std::size_t size_ = 0;
  std::array<AlignedVector<S>, kColumns> columns_ = {};
};

template <class S>
using GaussianColumns = ColumnTable<S, kParameterCount>;

inline Eigen::Vector3f MeanOf(const GaussianColumns<float>& gaussians, std::size_t row) {
  return {
      gaussians.Column(kMeanX)[row], gaussians.Column(kMeanY)[row], gaussians.Column(kMeanZ)[row]};
}

/// As stored: nearly of unit length.
inline Eigen::Quaternionf RotationOf(const GaussianColumns<float>& gaussians, std::size_t row) {
  return {gaussians.Column(kQuatW)[row],
          gaussians.Column(kQuatX)[row],
          gaussians.Column(kQuatY)[row],
          gaussians.Column(kQuatZ)[row]};
}

/// In [0, 1].
inline float OpacityOf(const GaussianColumns<float>& gaussians, std::size_t row) {
  return 1.0f / (1.0f + std::exp(-gaussians.Column(kOpacityLogit)[row]));
}

template <class S>
void WritePose(GaussianColumns<S>& gaussians,
               std::size_t row,
               const std::type_identity_t<Eigen::Matrix<S, 3, 1>>& mean,
               const std::type_identity_t<Eigen::Quaternion<S>>& rotation) {
  for (int k = 0; k < 3; ++k) {
    gaussians.Column(kMeanX + k)[row] = mean[k];
    gaussians.Column(kQuatX + k)[row] = rotation.vec()[k];
  }
  gaussians.Column(kQuatW)[row] = rotation.w();
}

template <class S>
void WriteGaussian(GaussianColumns<S>& gaussians,
                   std::size_t row,
                   const std::type_identity_t<Eigen::Matrix<S, 3, 1>>& mean,
                   const std::type_identity_t<Eigen::Quaternion<S>>& rotation,
                   const std::type_identity_t<Eigen::Matrix<S, 2, 1>>& log_scale,
                   std::type_identity_t<S> opacity_logit) {
  WritePose(gaussians, row, mean, rotation);
  gaussians.Column(kLogScaleU)[row] = log_scale[0];
  gaussians.Column(kLogScaleV)[row] = log_scale[1];
  gaussians.Column(kOpacityLogit)[row] = opacity_logit;
}

/// Whether it can be drawn: all numbers are finite, and its rotation has a length.
inline bool IsSound(const GaussianColumns<float>& gaussians, std::size_t row) {
  for (int p = 0; p < kParameterCount; ++p) {
    if (!std::isfinite(gaussians.Column(p)[row])) return false;
  }
  return RotationOf(gaussians, row).norm() > 1e-3f;
}

/// Gaussians [begin, end) of a table live in the frame of one anchor. `begin` is a multiple of
/// kBlockSize, so that no two ranges share a block; what lies between ranges is padding.
struct AnchorRange {
  int anchor = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

}  // namespace covsplat
