// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/combinations.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <utility>

#include "diagnose/findings/quantiles.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kUncertain = 0.15;  ///< relative deviation of a parameter not known alone
constexpr double kBetter = 5.0;      ///< how much better the combination is known
constexpr double kMember = 0.3;      ///< share in the worst direction that makes a member

}  // namespace

std::optional<Combination> combination_of(const std::vector<CombinedParameter>& parameters,
                                          const VectorXd& logs, const MatrixXd& covariance) {
  if (parameters.size() < 2) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> whole(covariance);
  const VectorXd worst = whole.eigenvectors().rightCols(1);
  std::vector<Index> members;
  for (Index p = 0; p < worst.size(); ++p) {
    if (std::abs(worst[p]) >= kMember) members.push_back(p);
  }
  if (members.size() < 2) return std::nullopt;
  const MatrixXd spread = covariance(members, members);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> within(spread);
  VectorXd powers = within.eigenvectors().col(0);
  Index first = 0;
  powers.cwiseAbs().maxCoeff(&first);
  powers /= powers[first];
  const double least_alone = std::sqrt(spread.diagonal().minCoeff());
  const double deviation = std::sqrt(powers.dot(spread * powers));
  if (least_alone < kUncertain || deviation * kBetter > least_alone) return std::nullopt;
  Combination out;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const auto k = static_cast<Index>(m);
    CombinedParameter p = parameters[static_cast<std::size_t>(members[m])];
    p.power = std::round(powers[k] * 100.0) / 100.0;
    p.relative_deviation = std::sqrt(spread(k, k));
    if (p.power != 0.0) out.parameters.push_back(std::move(p));
  }
  if (out.parameters.size() < 2) return std::nullopt;
  const double middle = powers.dot(logs(members));
  const double half = kNormal95 * deviation;
  out.value = std::exp(middle);
  out.ci95 = {std::exp(middle - half), std::exp(middle + half)};
  return out;
}

}  // namespace ravencal::diagnose
