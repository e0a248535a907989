#include "covsplat/loops/block_matrix.hpp"

#include <algorithm>
#include <limits>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr int kBlock = 6;
// Of variables that nothing determines: keeps them where they are.
constexpr double kNothing = 1e-12;

}  // namespace

BlockMatrix::BlockMatrix(int blocks, std::span<const std::pair<int, int>> pattern)
    : matrix_(Eigen::Index{kBlock} * blocks, Eigen::Index{kBlock} * blocks),
      rows_(static_cast<std::size_t>(blocks)) {
  for (std::size_t column = 0; column < rows_.size(); ++column) {
    rows_[column].push_back(static_cast<int>(column));
  }
  for (const auto& [row, column] : pattern) {
    COVSPLAT_CHECK(row > column);
    rows_[static_cast<std::size_t>(column)].push_back(row);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t column = 0; column < rows_.size(); ++column) {
    std::vector<int>& rows = rows_[column];
    std::ranges::sort(rows);
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    for (const int row : rows) {
      for (int k = 0; k < kBlock * kBlock; ++k) {
        entries.emplace_back(
            kBlock * row + k % kBlock, kBlock * static_cast<int>(column) + k / kBlock, 0.0);
      }
    }
  }
  matrix_.setFromTriplets(entries.begin(), entries.end());
  factors_.analyzePattern(matrix_);
}

void BlockMatrix::SetZero() { std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0); }

void BlockMatrix::Add(int row, int column, const Matrix6d& block) {
  const std::vector<int>& rows = rows_[static_cast<std::size_t>(column)];
  const auto at = std::ranges::lower_bound(rows, row);
  COVSPLAT_CHECK(at != rows.end() && *at == row);
  const auto inner = kBlock * static_cast<int>(at - rows.begin());
  for (int c = 0; c < kBlock; ++c) {
    const int start = matrix_.outerIndexPtr()[kBlock * column + c] + inner;
    Eigen::Map<Vector6d>(matrix_.valuePtr() + start) += block.col(c);
  }
}

Eigen::VectorXd BlockMatrix::Solve(const Eigen::VectorXd& b, double damping) {
  Eigen::SparseMatrix<double> damped = matrix_;
  damped.diagonal() = (1.0 + damping) * matrix_.diagonal().array() + kNothing;
  factors_.factorize(damped);
  if (factors_.info() != Eigen::Success) {
    return Eigen::VectorXd::Constant(b.size(), std::numeric_limits<double>::quiet_NaN());
  }
  return factors_.solve(b);
}

}  // namespace covsplat
