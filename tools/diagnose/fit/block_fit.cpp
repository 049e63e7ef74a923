// SPDX-License-Identifier: Apache-2.0
#include "diagnose/fit/block_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<VectorXd> fold_coefficients(const Blocks& blocks, const Moments& moments,
                                        const VectorXd& precision, double relative_ridge) {
  const MatrixXd total = moments.total();
  std::vector<VectorXd> coefficients;
  for (int fold = 0; fold < kFolds; ++fold) {
    MatrixXd rest = total;
    for (std::size_t b = 0; b < blocks.count(); ++b) {
      if (blocks.fold[b] == fold) rest -= moments.block[b];
    }
    coefficients.push_back(solve(rest, precision, relative_ridge));
  }
  return coefficients;
}

}  // namespace

MatrixXd Moments::total() const {
  MatrixXd sum = MatrixXd::Zero(block.front().rows(), block.front().cols());
  for (const MatrixXd& m : block) sum += m;
  return sum;
}

Moments moments_of(const Blocks& blocks, const MatrixXd& columns, const VectorXd& target) {
  Moments moments;
  MatrixXd joined(columns.rows(), columns.cols() + 1);
  joined << columns, target;
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const auto part = joined.middleRows(blocks.first(b), blocks.size(b));
    moments.block.emplace_back(part.transpose() * part);
  }
  return moments;
}

Moments extended(const Blocks& blocks, const Moments& moments, const MatrixXd& columns,
                 const MatrixXd& further, const VectorXd& target) {
  const Index k = columns.cols();
  const Index m = further.cols();
  Moments out;
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const auto x = columns.middleRows(blocks.first(b), blocks.size(b));
    const auto z = further.middleRows(blocks.first(b), blocks.size(b));
    const auto y = target.segment(blocks.first(b), blocks.size(b));
    MatrixXd g(k + m + 1, k + m + 1);
    g.topLeftCorner(k, k) = moments.block[b].topLeftCorner(k, k);
    g.block(0, k, k, m) = x.transpose() * z;
    g.block(k, k, m, m) = z.transpose() * z;
    g.topRightCorner(k, 1) = moments.block[b].topRightCorner(k, 1);
    g.block(k, k + m, m, 1) = z.transpose() * y;
    g(k + m, k + m) = moments.block[b](k, k);
    g.triangularView<Eigen::StrictlyLower>() = g.transpose();
    out.block.push_back(std::move(g));
  }
  return out;
}

VectorXd solve(const MatrixXd& total, const VectorXd& precision, double relative_ridge) {
  const Index k = total.rows() - 1;
  if (k == 0) return {};
  VectorXd scale = total.diagonal().head(k);
  for (Index i = 0; i < k; ++i) scale[i] = scale[i] > 0.0 ? 1.0 / std::sqrt(scale[i]) : 0.0;
  MatrixXd normal = scale.asDiagonal() * total.topLeftCorner(k, k) * scale.asDiagonal();
  normal.diagonal() += (precision.array() * scale.array().square()).matrix();
  normal.diagonal().array() += relative_ridge;
  for (Index i = 0; i < k; ++i) {
    if (scale[i] == 0.0) normal(i, i) = 1.0;
  }
  const VectorXd right = scale.cwiseProduct(total.col(k).head(k));
  return scale.cwiseProduct(normal.ldlt().solve(right));
}

// Active set of a least squares problem in a box (Stark and Parker, Computational Statistics 1995):
// the coefficient furthest out is put on its limit, and taken off again where the others' company
// pulls it back in.
VectorXd solve_within(const MatrixXd& total, const VectorXd& precision, const VectorXd& limit) {
  const Index k = limit.size();
  VectorXd held = VectorXd::Zero(k);
  VectorXd b;
  for (Index round = 0; round < 4 * k + 4; ++round) {
    MatrixXd left = total;
    for (Index i = 0; i < k; ++i) {
      if (held[i] == 0.0) continue;
      left.col(k).head(k) -= held[i] * total.col(i).head(k);
    }
    for (Index i = 0; i < k; ++i) {
      if (held[i] == 0.0) continue;
      left.row(i).setZero();
      left.col(i).setZero();
    }
    b = solve(left, precision);
    b = (held.array() != 0.0).select(held, b);
    Index furthest = -1, wrong = -1;
    double excess = 1.0, pull = 0.0;
    for (Index i = 0; i < k; ++i) {
      if (held[i] == 0.0 && std::abs(b[i]) > excess * limit[i]) {
        excess = std::abs(b[i]) / limit[i];
        furthest = i;
      }
      if (held[i] == 0.0) continue;
      const double slope = total(i, k) - total.row(i).head(k).dot(b) - precision[i] * b[i];
      const double inward = -slope * held[i];
      if (inward > pull) {
        pull = inward;
        wrong = i;
      }
    }
    if (furthest >= 0) {
      held[furthest] = std::copysign(limit[furthest], b[furthest]);
    } else if (wrong >= 0 && round < 3 * k) {
      held[wrong] = 0.0;
    } else {
      break;
    }
  }
  return b;
}

double squared_error(const MatrixXd& moments, const VectorXd& coefficients) {
  const Index k = coefficients.size();
  return std::max(0.0, moments(k, k) - 2.0 * coefficients.dot(moments.col(k).head(k)) +
                           coefficients.dot(moments.topLeftCorner(k, k) * coefficients));
}

VectorXd held_out_error(const Blocks& blocks, const Moments& moments, const VectorXd& precision,
                        double relative_ridge) {
  const auto coefficients = fold_coefficients(blocks, moments, precision, relative_ridge);
  VectorXd error(static_cast<Index>(blocks.count()));
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    error[static_cast<Index>(b)] =
        squared_error(moments.block[b], coefficients[static_cast<std::size_t>(blocks.fold[b])]);
  }
  return error;
}

VectorXd held_out_residual(const Blocks& blocks, const Moments& moments, const VectorXd& precision,
                           const MatrixXd& columns, const VectorXd& target, double relative_ridge) {
  const auto coefficients = fold_coefficients(blocks, moments, precision, relative_ridge);
  VectorXd residual = target;
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    residual.segment(blocks.first(b), blocks.size(b)) -=
        columns.middleRows(blocks.first(b), blocks.size(b)) *
        coefficients[static_cast<std::size_t>(blocks.fold[b])];
  }
  return residual;
}

}  // namespace ravencal::diagnose
