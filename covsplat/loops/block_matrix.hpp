// BlockMatrix: a sparse symmetric matrix of 6 x 6 blocks whose pattern is known beforehand.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include <Eigen/SparseCholesky>

#include "covsplat/core/se3.hpp"

namespace covsplat {

/// The lower triangle of normal equations of poses. Adding to a block and solving allocate nothing
/// but what the factors need; the ordering is found once.
class BlockMatrix {
 public:
  /// `pattern`: (row, column) of the blocks below the diagonal, row > column, each any number of
  /// times. Blocks on the diagonal are always there.
  BlockMatrix(int blocks, std::span<const std::pair<int, int>> pattern);

  void SetZero();
  /// Row >= column; the block must be in the pattern.
  void Add(int row, int column, const Matrix6d& block);
  /// Solves (M + damping * diag(M)) x = b; not finite where the matrix is not positive definite.
  Eigen::VectorXd Solve(const Eigen::VectorXd& b, double damping);

 private:
  Eigen::SparseMatrix<double> matrix_;
  std::vector<std::vector<int>> rows_;  ///< of each block column, ascending, first the diagonal's
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factors_;
};

}  // namespace covsplat
