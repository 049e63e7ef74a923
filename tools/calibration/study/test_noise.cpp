// SPDX-License-Identifier: Apache-2.0
#include "study/test_noise.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/random.hpp"

namespace ravencal::study {
namespace {

/// Uniform noise over [low, high] of one column.
struct Span {
  double low = 0.0;
  double high = 0.0;
};

Span span_of(const model::CalibrationModel& model, Eigen::Index column, Noise noise) {
  switch (noise) {
    case Noise::kDeviation: {
      // A column that never changed in training has scale 1 for want of a deviation, which is 0.
      const bool constant = model.input_min(column) == model.input_max(column);
      const double deviation = constant ? 0.0 : model.input.scale(column);
      return {-deviation, deviation};
    }
    case Noise::kMean: {
      const double magnitude = std::abs(model.input.mean(column));
      return {-magnitude, magnitude};
    }
    case Noise::kRange:
      return {model.input_min(column), model.input_max(column)};
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

model::FeatureMatrix spoil(model::FeatureMatrix inputs, const model::CalibrationModel& model,
                           const std::vector<Eigen::Index>& columns, Noise noise,
                           std::uint64_t seed) {
  core::Random random(seed);
  const float factor = factor_of(noise);
  for (const Eigen::Index column : columns) {
    const Span span = span_of(model, column, noise);
    for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
      const double added = span.low + (span.high - span.low) * random.uniform();
      inputs(row, column) =
          static_cast<float>(static_cast<double>(factor * inputs(row, column)) + added);
    }
  }
  return inputs;
}

}  // namespace ravencal::study
