// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/circumstances.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/median.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kFewestRowsCompared = 20.0;
constexpr double kFewestBlocks = 6.0;
/// Of the contribution's energy, what half of the rows must hold about its mean there: of friction
/// within one direction the size cannot be seen.
constexpr double kLeastEnergy = 0.1;

struct Scale {
  double factor = 1.0;
  double error = 0.0;  ///< blocks as observations (sandwich)
};

/// Least squares in the rows where `in` is set.
std::optional<Scale> scale_in(const VectorXd& part, const VectorXd& left,
                              const std::vector<int>& blocks, const std::vector<char>& in) {
  std::vector<Index> rows;
  for (Index i = 0; i < part.size(); ++i)
    if (in[static_cast<std::size_t>(i)] != 0) rows.push_back(i);
  const auto count = static_cast<double>(rows.size());
  if (count < kFewestRowsCompared) return std::nullopt;
  const VectorXd x = part(rows).array() - part(rows).mean();
  const VectorXd without = part(rows) + left(rows);
  const VectorXd y = without.array() - without.mean();
  const double energy = x.squaredNorm();
  const double whole = (part.array() - part.mean()).square().sum();
  if (!(energy > 0.0) || energy < kLeastEnergy * whole) return std::nullopt;
  Scale out{x.dot(y) / energy, 0.0};
  std::map<int, double> scores;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto i = static_cast<Index>(k);
    scores[blocks[static_cast<std::size_t>(rows[k])]] += x[i] * (y[i] - out.factor * x[i]);
  }
  const auto seen = static_cast<double>(scores.size());
  if (seen < kFewestBlocks) return std::nullopt;
  double variance = 0.0;
  for (const auto& [block, score] : scores) variance += score * score;
  out.error = std::sqrt(variance * seen / (seen - 2.0)) / energy;
  return out;
}

struct Cut {
  std::string low, high;
  VectorXd value;
  double middle = 0.0;
};

std::vector<Cut> cuts_of(const ChannelRows& at) {
  const VectorXd speed = at.speed_ji_per_s.cwiseAbs();
  std::vector<Cut> out = {
      {"direction: negative", "direction: positive", at.speed_ji_per_s, 0.0},
      {"speed: low half", "speed: high half", speed, core::upper_median(speed)}};
  if (at.load_ji.size() > 0)
    out.push_back(
        {"load: low half", "load: high half", at.load_ji, core::upper_median(at.load_ji)});
  return out;
}

}  // namespace

std::vector<RegimeScale> scales_of(const std::string& effect, const VectorXd& contribution,
                                   const VectorXd& left, const ChannelRows& at) {
  std::vector<RegimeScale> out;
  for (const Cut& cut : cuts_of(at)) {
    std::vector<char> low, high;
    for (const double value : cut.value) {
      low.push_back(value < cut.middle ? 1 : 0);
      high.push_back(value < cut.middle ? 0 : 1);
    }
    const auto below = scale_in(contribution, left, at.blocks, low);
    const auto above = scale_in(contribution, left, at.blocks, high);
    if (!below || !above) continue;
    out.push_back({effect, cut.low, below->factor, below->error});
    out.push_back({effect, cut.high, above->factor, above->error});
  }
  return out;
}

double spread_of(const std::vector<RegimeScale>& scales) {
  double most = 0.0;
  for (std::size_t i = 0; i + 1 < scales.size(); i += 2)
    most = std::max(most, std::abs(scales[i].scale - scales[i + 1].scale));
  return most;
}

}  // namespace ravencal::diagnose
