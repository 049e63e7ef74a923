// SPDX-License-Identifier: Apache-2.0
#include "choice/basis.hpp"

#include <cmath>
#include <random>

namespace ravencal::choice {
namespace {

/// Spread of a unit's bias over that of its weighted sum: centres of the units cover the rows.
constexpr double kBiasSpread = 2.0;

/// In (0, 1). The standard library's distributions differ between libraries, its generator does
/// not.
double uniform(std::mt19937_64& generator) {
  return (static_cast<double>(generator() >> 11U) + 0.5) * 0x1p-53;
}

double gaussian(std::mt19937_64& generator) {
  constexpr double kTwoPi = 6.283185307179586;
  const double radius = std::sqrt(-2.0 * std::log(uniform(generator)));
  return radius * std::cos(kTwoPi * uniform(generator));
}

}  // namespace

Basis draw(const BasisSpec& spec) {
  std::mt19937_64 generator(spec.seed);
  const auto columns = static_cast<Eigen::Index>(spec.columns.size());
  const double per_input = spec.steepness / std::sqrt(static_cast<double>(columns));
  Basis basis{spec.columns, Eigen::MatrixXd(spec.units, columns), Eigen::VectorXd(spec.units)};
  for (Eigen::Index unit = 0; unit < spec.units; ++unit) {
    for (Eigen::Index c = 0; c < columns; ++c)
      basis.weights(unit, c) = per_input * gaussian(generator);
    basis.biases[unit] = spec.steepness * kBiasSpread * (2.0 * uniform(generator) - 1.0);
  }
  return basis;
}

Eigen::MatrixXd Basis::design(const Eigen::MatrixXd& scaled) const {
  const Eigen::MatrixXd inputs = scaled(Eigen::all, columns);
  Eigen::MatrixXd design(inputs.rows(), size());
  if (weights.rows() > 0) {
    auto units = design.leftCols(weights.rows());
    units.noalias() = inputs * weights.transpose();
    units.rowwise() += biases.transpose();
    units = units.array().tanh().matrix();
  }
  design.middleCols(weights.rows(), inputs.cols()) = inputs;
  design.rightCols(1).setOnes();
  return design;
}

}  // namespace ravencal::choice
