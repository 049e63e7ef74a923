// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/combinations.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kUncertain = 0.15;  ///< relative deviation of a parameter not known alone
constexpr double kBetter = 5.0;      ///< how much better the combination is known
constexpr double kMember = 0.3;      ///< share in the worst direction that makes a member

MatrixXd covariance(const MatrixXd& draws) {
  const MatrixXd centred = draws.rowwise() - draws.colwise().mean();
  return centred.transpose() * centred / static_cast<double>(std::max<Index>(1, draws.rows() - 1));
}

}  // namespace

std::vector<Combination> combinations_of(const std::vector<CombinedParameter>& parameters,
                                         const MatrixXd& log_draws) {
  if (parameters.size() < 2 || log_draws.rows() < 20) return {};
  const Eigen::SelfAdjointEigenSolver<MatrixXd> whole(covariance(log_draws));
  const VectorXd worst = whole.eigenvectors().rightCols(1);
  std::vector<Index> members;
  for (Index p = 0; p < worst.size(); ++p) {
    if (std::abs(worst[p]) >= kMember) members.push_back(p);
  }
  if (members.size() < 2) return {};
  const MatrixXd group = log_draws(Eigen::all, members);
  const MatrixXd spread = covariance(group);
  const double least_alone = std::sqrt(spread.diagonal().minCoeff());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> within(spread);
  VectorXd powers = within.eigenvectors().col(0);
  Index first = 0;
  powers.cwiseAbs().maxCoeff(&first);
  powers /= powers[first];
  VectorXd values = group * powers;
  std::sort(values.data(), values.data() + values.size());
  const double deviation = std::sqrt(covariance(group * powers)(0, 0));
  if (least_alone < kUncertain || deviation * kBetter > least_alone) return {};
  Combination out;
  for (std::size_t m = 0; m < members.size(); ++m) {
    CombinedParameter p = parameters[static_cast<std::size_t>(members[m])];
    p.power = std::round(powers[static_cast<Index>(m)] * 100.0) / 100.0;
    p.relative_deviation = std::sqrt(spread(static_cast<Index>(m), static_cast<Index>(m)));
    if (p.power != 0.0) out.parameters.push_back(std::move(p));
  }
  const auto at = [&](double share) {
    return std::exp(values[static_cast<Index>(share * static_cast<double>(values.size() - 1))]);
  };
  out.value = at(0.5);
  out.ci95 = {at(0.025), at(0.975)};
  if (out.parameters.size() < 2) return {};
  return {out};
}

}  // namespace ravencal::diagnose
