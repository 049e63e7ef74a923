// SPDX-License-Identifier: Apache-2.0
#include "diagnose/model/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/median.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr std::array kTimes_s = {0.04, 0.15, 0.5, 1.5, 5.0, 20.0};
constexpr std::array kRatios = {0.1, 0.4, 1.5, 6.0, 30.0, 300.0};
constexpr double kFreedom = 4.0;  // of the Student t
constexpr int kScaleRounds = 6;
constexpr std::size_t kFewestInnovations = 50;
constexpr double kLeastScaleValue = 1e-15;  // of signals without any noise
/// Deviation over the scale of the Student t, trimmed as Huber's loss trims it.
constexpr double kPerScale = 1.15;

struct Scale {
  double value = 1.0;
  double minus_log_likelihood = std::numeric_limits<double>::infinity();
};

Scale scale_of(const std::vector<double>& innovations, double log_scale, double least_share) {
  const auto count = static_cast<double>(innovations.size());
  double squares = 0.0;
  for (const double e : innovations) squares += e * e;
  const double least = least_share * std::sqrt(squares / count);
  Scale scale;
  scale.value = std::max({core::normal_deviation(innovations), least, kLeastScaleValue});
  for (int round = 0; round < kScaleRounds; ++round) {
    double sum = 0.0;
    for (const double e : innovations)
      sum += (kFreedom + 1.0) * e * e / (kFreedom + e * e / (scale.value * scale.value));
    scale.value = std::max({std::sqrt(sum / count), least, kLeastScaleValue});
  }
  scale.minus_log_likelihood = count * std::log(scale.value) + log_scale;
  for (const double e : innovations)
    scale.minus_log_likelihood +=
        0.5 * (kFreedom + 1.0) * std::log1p(e * e / (kFreedom * scale.value * scale.value));
  return scale;
}

/// Takes the recording's constant, a parameter and no wander, out of its innovations; the
/// constant's information, which the likelihood of the rest lacks (Patterson and Thompson 1971).
double without_constant(const Whitener& whitener, Index rows, VectorXd& innovations) {
  if (innovations.size() == 0) return 1.0;
  VectorXd level(innovations.size());
  whitener.apply(VectorXd::Ones(rows), level);
  const double information = level.squaredNorm();
  innovations -= level.dot(innovations) / information * level;
  return information;
}

}  // namespace

Whitener::Whitener(const NoiseRows& rows, const NoiseModel& noise)
    : keep_(std::exp(-rows.period_s / noise.time_s)),
      deviation_(noise.deviation),
      gain_(rows.used.size(), 0.0),
      weight_(rows.used.size(), 0.0),
      fresh_(rows.fresh) {
  double variance = 1.0;
  for (std::size_t i = 0; i < rows.used.size(); ++i) {
    if (fresh_[i] != 0) variance = 1.0;
    if (rows.used[i] != 0) {
      const double innovation = variance + noise.white_ratio + rows.doubt[i];
      gain_[i] = variance / innovation;
      weight_[i] = 1.0 / std::sqrt(innovation);
      variance *= 1.0 - gain_[i];
    }
    variance = keep_ * keep_ * variance + 1.0 - keep_ * keep_;
  }
}

void Whitener::apply(const VectorXd& x, Eigen::Ref<VectorXd> out) const {
  double expected = 0.0;
  Index used = 0;
  for (Index i = 0; i < x.size(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (fresh_[n] != 0) expected = 0.0;
    if (weight_[n] > 0.0) {
      const double innovation = x[i] - expected;
      out[used++] = innovation * weight_[n] / deviation_;
      expected += gain_[n] * innovation;
    }
    expected *= keep_;
  }
}

VectorXd Whitener::undo(const Eigen::Ref<const VectorXd>& innovations) const {
  VectorXd out(static_cast<Index>(weight_.size()));
  double expected = 0.0;
  Index used = 0;
  for (Index i = 0; i < out.size(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (fresh_[n] != 0) expected = 0.0;
    out[i] = expected;
    if (weight_[n] > 0.0) {
      const double innovation = innovations[used++] * deviation_ / weight_[n];
      out[i] += innovation;
      expected += gain_[n] * innovation;
    }
    expected *= keep_;
  }
  return out;
}

double Whitener::log_scale() const {
  double sum = 0.0;
  for (const double weight : weight_)
    if (weight > 0.0) sum -= std::log(weight);
  return sum;
}

NoiseModel estimate_noise(const std::vector<const NoiseRows*>& rows,
                          const std::vector<const VectorXd*>& residuals, double least_share,
                          double longest_s) {
  NoiseModel best;
  double least = std::numeric_limits<double>::infinity();
  for (const double time_s : kTimes_s) {
    if (time_s > longest_s) break;
    for (const double ratio : kRatios) {
      std::vector<double> innovations;
      double log_scale = 0.0;
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const Whitener whitener(*rows[r], {time_s, ratio, 1.0});
        VectorXd white(std::count(rows[r]->used.begin(), rows[r]->used.end(), 1));
        whitener.apply(*residuals[r], white);
        log_scale += 0.5 * std::log(without_constant(whitener, residuals[r]->size(), white));
        for (const double e : white) innovations.push_back(std::abs(e));
        log_scale += whitener.log_scale();
      }
      if (innovations.size() < kFewestInnovations) continue;
      const Scale scale = scale_of(innovations, log_scale, least_share);
      if (scale.minus_log_likelihood >= least) continue;
      least = scale.minus_log_likelihood;
      best = {time_s, ratio, kPerScale * scale.value};
    }
  }
  return best;
}

}  // namespace ravencal::diagnose
