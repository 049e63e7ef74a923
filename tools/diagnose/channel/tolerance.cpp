// SPDX-License-Identifier: Apache-2.0
//
// How well the recording fixes the parameters that the plant has.
#include <cmath>
#include <random>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kToleranceResamples = 100;

}  // namespace

VectorXd nominal_deviation(const ChannelFit& fit, std::uint64_t seed) {
  const auto count = static_cast<Index>(fit.nominal->terms.size());
  const MatrixXd columns = fit.model.columns();
  const Moments moments = moments_of(fit.model.blocks, columns, fit.model.target);
  const VectorXd precision = fit.model.column_precision(columns.cols());
  std::mt19937_64 engine(seed);
  VectorXd square = VectorXd::Zero(count);
  for (int r = 0; r < kToleranceResamples; ++r) {
    MatrixXd sum = MatrixXd::Zero(columns.cols() + 1, columns.cols() + 1);
    for (std::size_t n = 0; n < moments.block.size(); ++n)
      sum += moments.block[engine() % moments.block.size()];
    const VectorXd drawn = solve(sum, precision, 1e-6);
    square += (drawn - fit.coefficients).segment(1, count).array().square().matrix();
  }
  return (square / kToleranceResamples).cwiseSqrt();
}

}  // namespace ravencal::diagnose
