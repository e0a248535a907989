// The map's primitives: flat 2D Gaussians (surfels) stored one column per parameter.
#pragma once

#include <algorithm>
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

/// Rows of a table that are elsewhere now.
struct RowRun {
  std::size_t to = 0;
  std::size_t from = 0;
  std::size_t count = 0;
};

/// What becomes of a table whose rows are moved or left out. Rows in no run stay where they are, if
/// the table is still that long.
struct RowMoves {
  std::size_t size = 0;  ///< of the table now
  std::vector<RowRun> runs;

  /// One row after the other; one that stays where it was is none.
  void Add(std::size_t to, std::size_t from);
};

/// Costs as much as what moves, however long the table is.
template <class T, class Allocator>
void MoveRows(const RowMoves& moves, std::vector<T, Allocator>& values) {
  std::vector<T> moved;
  for (const RowRun& run : moves.runs) {
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(run.from);
    moved.insert(moved.end(), from, from + static_cast<std::ptrdiff_t>(run.count));
  }
  values.resize(moves.size);
  auto next = moved.begin();
  for (const RowRun& run : moves.runs) {
    const auto end = next + static_cast<std::ptrdiff_t>(run.count);
    std::copy(next, end, values.begin() + static_cast<std::ptrdiff_t>(run.to));
    next = end;
  }
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

  void Move(const RowMoves& moves) {
    for (auto& column : columns_) {
      MoveRows(moves, column);
      ResizeTightly(column, moves.size + kBlockSize);
    }
    size_ = moves.size;
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
