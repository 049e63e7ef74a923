// SPDX-License-Identifier: Apache-2.0
#include "choice/basis.hpp"

#include <cmath>

#include "core/random.hpp"

namespace ravencal::choice {
namespace {

/// Spread of a unit's bias over that of its weighted sum: centres of the units cover the rows.
constexpr double kBiasSpread = 2.0;

/// In (0, 1): the middle of the interval that Random::uniform() begins.
double uniform(core::Random& random) { return random.uniform() + 0x1p-54; }

/// Box and Muller, 1958.
double gaussian(core::Random& random) {
  constexpr double kTwoPi = 6.283185307179586;
  const double radius = std::sqrt(-2.0 * std::log(uniform(random)));
  return radius * std::cos(kTwoPi * uniform(random));
}

/// Of 64 bits, the golden ratio's: seeds that differ by little share no draw.
constexpr std::uint64_t kNextDraw = 0x9E3779B97F4A7C15;

}  // namespace

Basis draw(const BasisSpec& spec, int which) {
  core::Random random(spec.seed + static_cast<std::uint64_t>(which) * kNextDraw);
  const auto columns = static_cast<Eigen::Index>(spec.columns.size());
  const double per_input = spec.steepness / std::sqrt(static_cast<double>(columns));
  Basis basis{spec.columns, Eigen::MatrixXd(spec.units, columns), Eigen::VectorXd(spec.units)};
  for (Eigen::Index unit = 0; unit < spec.units; ++unit) {
    for (Eigen::Index c = 0; c < columns; ++c)
      basis.weights(unit, c) = per_input * gaussian(random);
    basis.biases[unit] = spec.steepness * kBiasSpread * (2.0 * uniform(random) - 1.0);
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
