// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/invariance.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/median.hpp"
#include "diagnose/effects/regimes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Half {
  double scale = 1.0;
  double error = 0.0;
  double blocks = 0.0;
  bool usable = false;
};

/// Scale of `part` in the rows where `in` is set, beside a free constant; the other effects stay as
/// fitted. Error by blocks (sandwich).
Half scale_in(const ChannelModel& model, const VectorXd& part, const VectorXd& residual,
              const std::vector<char>& in) {
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (Index i = 0; i < part.size(); ++i) {
    if (in[static_cast<std::size_t>(i)] == 0) continue;
    const double y = residual[i] + part[i];
    n += 1.0;
    sx += part[i];
    sy += y;
    sxx += part[i] * part[i];
    sxy += part[i] * y;
  }
  Half half;
  const double energy = n > 0.0 ? sxx - sx * sx / n : 0.0;
  // Where the contribution hardly varies (friction within one direction), its size cannot be seen.
  if (n < 20.0 || energy < 0.1 * part.squaredNorm()) return half;
  half.scale = (sxy - sx * sy / n) / energy;
  const double mean_x = sx / n;
  const double offset = sy / n - half.scale * mean_x;
  double variance = 0.0;
  double used = 0.0;
  for (std::size_t b = 0; b < model.blocks.count(); ++b) {
    double score = 0.0;
    bool any = false;
    for (Index i = model.blocks.first(b); i < model.blocks.first(b) + model.blocks.size(b); ++i) {
      if (in[static_cast<std::size_t>(i)] == 0) continue;
      any = true;
      score += (part[i] - mean_x) * (residual[i] + part[i] - half.scale * part[i] - offset);
    }
    variance += score * score;
    used += any ? 1.0 : 0.0;
  }
  half.error = std::sqrt(variance * used / std::max(1.0, used - 2.0)) / energy;
  half.blocks = used;
  half.usable = used >= 6.0;
  return half;
}

/// Share of each recording's own time: the order in which recordings are given is no time.
VectorXd time_of(const ChannelModel& model) {
  const std::vector<int>& recording = model.series->recording;
  const auto& rows = model.blocks.rows;
  VectorXd share(static_cast<Index>(rows.size()));
  for (std::size_t first = 0, last = 0; first < rows.size(); first = last) {
    const auto of = [&](std::size_t n) { return recording[static_cast<std::size_t>(rows[n])]; };
    while (last < rows.size() && of(last) == of(first)) ++last;
    for (std::size_t n = first; n < last; ++n)
      share[static_cast<Index>(n)] =
          static_cast<double>(n - first) / static_cast<double>(last - first);
  }
  return share;
}

}  // namespace

double Invariance::deviation() const {
  double most = 0.0;
  for (std::size_t i = 0; i + 1 < scales.size(); i += 2) {
    const double difference = scales[i].scale - scales[i + 1].scale;
    const double chance = std::hypot(scales[i].error, scales[i + 1].error);
    most = std::max(most, 0.5 * (difference * difference - chance * chance));
  }
  return std::sqrt(most);
}

Invariance invariance_of(const ChannelModel& model, const VectorXd& coefficients,
                         std::size_t chosen) {
  const MatrixXd columns = model.columns();
  const VectorXd residual = model.target - columns * coefficients;
  const Index at = model.first_column(chosen);
  const MatrixXd& own = model.chosen[chosen].columns;
  VectorXd part = own * coefficients.segment(at, own.cols());
  part.array() -= part.mean();

  const EffectForm& form = *model.candidates[model.chosen[chosen].candidate]->form;
  const std::string compared = form.compares(std::abs(coefficients[0]) >= model.floor);
  Invariance out;
  std::vector<std::pair<std::string, VectorXd>> cuts;
  for (const RegimeOf& c : circumstances(*model.series)) {
    if (c.name == "memory" || c.name.starts_with("position of") || c.name == compared) continue;
    cuts.emplace_back(c.name, model.blocks.gather(c.value).col(0));
  }
  cuts.emplace_back("time", time_of(model));
  for (const auto& [name, value] : cuts) {
    const double middle = name == "direction" ? 0.0 : core::upper_median(value);
    std::vector<char> low(static_cast<std::size_t>(part.size()));
    std::vector<char> high(low.size());
    for (Index i = 0; i < part.size(); ++i) {
      low[static_cast<std::size_t>(i)] = value[i] < middle ? 1 : 0;
      high[static_cast<std::size_t>(i)] = value[i] < middle ? 0 : 1;
    }
    const Half a = scale_in(model, part, residual, low);
    const Half b = scale_in(model, part, residual, high);
    if (!a.usable || !b.usable) continue;
    out.scales.push_back({name + ": low", a.scale, a.error});
    out.scales.push_back({name + ": high", b.scale, b.error});
    const double difference = std::abs(a.scale - b.scale);
    const double z = difference / std::max(std::hypot(a.error, b.error), 1e-12);
    // Student's quantile at a normal's 3 sigma, to 5 %: 3 (1 + 3.5 / degrees of freedom).
    const double least_z = kProxy_z * (1.0 + 3.5 / (std::min(a.blocks, b.blocks) - 2.0));
    const bool worse = (difference > kProxySpread && z > least_z)
                           ? !out.is_proxy() || difference > out.spread
                           : !out.is_proxy() && difference > out.spread;
    if (worse) {
      out.spread = difference;
      out.z = z;
      out.least_z = least_z;
      out.worst = name;
    }
  }
  return out;
}

}  // namespace ravencal::diagnose
