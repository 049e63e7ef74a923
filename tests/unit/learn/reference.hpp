// SPDX-License-Identifier: Apache-2.0
//
// The independent reference of one training run (double precision, numpy), as this project's types.
#pragma once

#include <optional>
#include <vector>

#include "learn/trainer.hpp"

namespace ravencal::learn {

struct Reference {
  Shape shape{1, {}, 1, model::Activation::kSigmoid};
  TrainerSettings settings;
  Samples<double> samples;
  std::vector<double> parameters;  ///< at the start, in the layout of `shape`
  std::vector<double> gradient;
  std::vector<double> parameters_after_10;  ///< full-batch Adam steps
  double mean_squared_error = 0.0;
  double penalty = 0.0;
};

/// Nothing if the reference's folder is not on this machine.
std::optional<Reference> load_reference();

template <typename Scalar>
Samples<Scalar> samples_as(const Samples<double>& samples) {
  return {samples.inputs.cast<Scalar>(), samples.targets.cast<Scalar>()};
}

/// Largest difference, relative to the largest magnitude of `expected`.
template <typename Scalar>
double relative_difference(std::span<const Scalar> actual, std::span<const double> expected) {
  double difference = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    difference = std::max(difference, std::abs(static_cast<double>(actual[i]) - expected[i]));
    size = std::max(size, std::abs(expected[i]));
  }
  return difference / size;
}

}  // namespace ravencal::learn
