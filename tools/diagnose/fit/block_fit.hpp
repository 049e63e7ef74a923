// SPDX-License-Identifier: Apache-2.0
//
// Linear least squares on moments per block: once X'X of each block is known, every refit, every
// cross-validation and every permutation is small linear algebra.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnose/fit/blocks.hpp"

namespace ravencal::diagnose {

/// Moments of [X y] per block; y is the last column.
struct Moments {
  std::vector<Eigen::MatrixXd> block;  ///< [(k + 1) x (k + 1)] each
  [[nodiscard]] Eigen::Index columns() const {
    return block.empty() ? 0 : block.front().rows() - 1;
  }
  [[nodiscard]] Eigen::MatrixXd total() const;
};

/// Columns [n x k] and target [n] at the training rows.
Moments moments_of(const Blocks& blocks, const Eigen::MatrixXd& columns,
                   const Eigen::VectorXd& target);

/// The same with further columns between X and y.
Moments extended(const Blocks& blocks, const Moments& moments, const Eigen::MatrixXd& columns,
                 const Eigen::MatrixXd& further, const Eigen::VectorXd& target);

/// Coefficients that minimise |y - X b|^2 + sum precision_i b_i^2. A tiny relative ridge keeps
/// columns that imitate each other finite.
Eigen::VectorXd solve(const Eigen::MatrixXd& total, const Eigen::VectorXd& precision,
                      double relative_ridge = 1e-9);

/// The same with each coefficient between plus and minus its limit (infinite: free); those that
/// would leave it stand on it exactly.
Eigen::VectorXd solve_within(const Eigen::MatrixXd& total, const Eigen::VectorXd& precision,
                             const Eigen::VectorXd& limit);

/// |y - X b|^2 of one block's moments.
double squared_error(const Eigen::MatrixXd& moments, const Eigen::VectorXd& coefficients);

/// Squared error of each block under the fit to the other folds, [blocks].
Eigen::VectorXd held_out_error(const Blocks& blocks, const Moments& moments,
                               const Eigen::VectorXd& precision, double relative_ridge = 1e-9);

/// y - X b at the training rows, each under the fit to the other folds.
Eigen::VectorXd held_out_residual(const Blocks& blocks, const Moments& moments,
                                  const Eigen::VectorXd& precision, const Eigen::MatrixXd& columns,
                                  const Eigen::VectorXd& target, double relative_ridge = 1e-9);

}  // namespace ravencal::diagnose
