// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/homings.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Takes the means of `error` over the training rows of each recording out of the series, but not
/// the mean of all; gives the greatest of them.
double take_out_means(const VectorXd& error, const std::vector<Index>& rows, Series& series) {
  std::map<int, std::pair<double, double>> sums;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    auto& [sum, count] = sums[series.recording[static_cast<std::size_t>(rows[n])]];
    sum += error[static_cast<Index>(n)];
    count += 1.0;
  }
  const double all = error.mean();
  double greatest = 0.0;
  for (Index i = 0; i < series.rows(); ++i) {
    const auto own = sums.find(series.recording[static_cast<std::size_t>(i)]);
    if (own == sums.end()) continue;
    const double mean = own->second.first / own->second.second - all;
    series.y[i] -= mean;
    greatest = std::max(greatest, std::abs(mean));
  }
  return greatest;
}

}  // namespace

std::shared_ptr<Series> homed_series(const Series& series, const physics::Plant& plant) {
  auto homed = std::make_shared<Series>(series);
  homed->homing_draws = series.stage == Stage::kTransmission &&
                        plant_has(plant, series.joint, homing_offset_kind().id(), "");
  if (!homed->homing_draws) return homed;
  std::vector<Index> rows;
  for (Index i = 0; i < series.rows(); ++i)
    if (series.trains(i)) rows.push_back(i);
  const auto recording_of = [&](Index row) {
    return series.recording[static_cast<std::size_t>(row)];
  };
  if (rows.empty() || recording_of(rows.front()) == recording_of(rows.back())) return homed;
  homed->each_homed = true;
  const VectorXd error = series.y - nominal_of(series, plant).prediction;
  take_out_means(error(rows), rows, *homed);
  return homed;
}

VectorXd beside_homings(const Series& series, VectorXd error) {
  if (!series.homing_draws) return error;
  struct Mean {
    double sum = 0.0, count = 0.0;
    [[nodiscard]] double value() const { return sum / count; }
  };
  std::map<int, Mean> fitted, unseen;
  for (Index i = 0; i < series.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (series.valid[n] == 0) continue;
    Mean& mean = (series.trains(i) ? fitted : unseen)[series.recording[n]];
    mean.sum += error[i];
    mean.count += 1.0;
  }
  fitted.merge(unseen);
  for (Index i = 0; i < series.rows(); ++i) {
    const auto own = fitted.find(series.recording[static_cast<std::size_t>(i)]);
    if (own != fitted.end()) error[i] -= own->second.value();
  }
  return error;
}

VectorXd error_of_plant(const ChannelFit& fit) {
  const Series& series = *fit.model.series;
  return beside_homings(series, series.y - fit.nominal->prediction);
}

VectorXd error_of_findings(const ChannelFit& fit) {
  const Series& series = *fit.model.series;
  return beside_homings(series, series.y - fit.prediction);
}

bool take_out_homings(ChannelFit& fit) {
  if (!fit.series->each_homed) return false;
  const VectorXd left = fit.model.target - fit.model.columns() * fit.coefficients;
  return take_out_means(left, fit.model.blocks.rows, *fit.series) > kSettled * fit.model.floor;
}

}  // namespace ravencal::diagnose
