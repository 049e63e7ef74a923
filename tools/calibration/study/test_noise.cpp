// SPDX-License-Identifier: Apache-2.0
#include "study/test_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/random.hpp"

namespace ravencal::study {
namespace {

/// Uniform noise over [low, high] of one column.
struct Span {
  double low = 0.0;
  double high = 0.0;
};

Span span_of(const ColumnRanges& ranges, Eigen::Index column, Noise noise) {
  const auto within = [](double half_width) { return Span{-half_width, half_width}; };
  switch (noise) {
    case Noise::kDeviation:
      return within(ranges.deviation(column));
    case Noise::kMean:
      return within(0.5 * std::abs(ranges.mean(column)));
    case Noise::kRange:
      return within(0.5 * (ranges.greatest(column) - ranges.least(column)));
    default:
      return {};
  }
}

float factor_of(Noise noise) {
  switch (noise) {
    case Noise::kZero:
      return 0.0F;
    case Noise::kFlip:
      return -1.0F;
    case Noise::kTriple:
      return 3.0F;
    default:
      return 1.0F;
  }
}

}  // namespace

std::vector<Eigen::Index> columns_of(const model::CalibrationModel& model,
                                     const std::vector<record::Channel>& channels,
                                     const std::vector<std::string>& terms) {
  std::set<std::string> names;
  for (const std::string& term : terms) {
    const auto selected = model::select_features(term, channels);
    if (!selected.ok()) continue;
    for (const model::FeatureSpec& feature : *selected) names.insert(feature.channel);
  }
  std::vector<Eigen::Index> columns;
  for (std::size_t i = 0; i < model.features.size(); ++i) {
    if (names.contains(model.features[i].channel)) columns.push_back(static_cast<Eigen::Index>(i));
  }
  return columns;
}

ColumnRanges ranges_of_training(const model::CalibrationModel& model) {
  ColumnRanges ranges{model.input.mean, model.input.scale, model.input_min, model.input_max};
  // A column that never changed in training has scale 1 for want of a deviation, which is 0.
  ranges.deviation =
      (model.input_min.array() == model.input_max.array()).select(0.0, model.input.scale.array());
  return ranges;
}

ColumnRanges ranges_of_tests(std::span<const model::FeatureMatrix* const> tests) {
  const Eigen::Index columns = tests.front()->cols();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  ColumnRanges ranges{Eigen::VectorXd::Zero(columns), Eigen::VectorXd::Zero(columns),
                      Eigen::VectorXd::Constant(columns, kInfinite),
                      Eigen::VectorXd::Constant(columns, -kInfinite)};
  double rows = 0.0;
  // Welford's update: counts of millions beside deviations of a few are not subtracted as squares.
  for (const model::FeatureMatrix* const test : tests) {
    for (Eigen::Index row = 0; row < test->rows(); ++row) {
      const Eigen::VectorXd values = test->row(row).cast<double>();
      if (!values.allFinite()) continue;
      rows += 1.0;
      const Eigen::VectorXd before = values - ranges.mean;
      ranges.mean += before / rows;
      ranges.deviation += before.cwiseProduct(values - ranges.mean);
      ranges.least = ranges.least.cwiseMin(values);
      ranges.greatest = ranges.greatest.cwiseMax(values);
    }
  }
  ranges.deviation = (ranges.deviation / std::max(rows, 1.0)).cwiseSqrt();
  return ranges;
}

model::FeatureMatrix spoil(model::FeatureMatrix inputs, const ColumnRanges& ranges,
                           const std::vector<Eigen::Index>& columns, Noise noise,
                           std::uint64_t seed) {
  core::Random random(seed);
  const float factor = factor_of(noise);
  for (const Eigen::Index column : columns) {
    const Span span = span_of(ranges, column, noise);
    for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
      const double added = span.low + (span.high - span.low) * random.uniform();
      inputs(row, column) =
          static_cast<float>(static_cast<double>(factor * inputs(row, column)) + added);
    }
  }
  return inputs;
}

}  // namespace ravencal::study
