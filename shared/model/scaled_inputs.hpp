// SPDX-License-Identifier: Apache-2.0
//
// What the network of a finished model sees of its inputs, wherever it runs: the plugin
// (rt_plugin/loaded_model.cpp), ravencal's own arithmetic and the graph of an ONNX file.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "model/calibration_model.hpp"
#include "model/input_limits.hpp"
#include "model/layers.hpp"

namespace ravencal::model {

/// input_limits of every input, SI units, [inputs] each; empty where the model has no trained
/// ranges.
struct ClampedRange {
  Eigen::VectorXf low;
  Eigen::VectorXf high;
};

inline ClampedRange clamped_range(const CalibrationModel& model) {
  const Eigen::Index inputs = model.input_min.size();
  ClampedRange range{Eigen::VectorXf(inputs), Eigen::VectorXf(inputs)};
  for (Eigen::Index i = 0; i < inputs; ++i) {
    const InputLimits limits = input_limits(model.input_min[i], model.input_max[i]);
    range.low[i] = limits.low;
    range.high[i] = limits.high;
  }
  return range;
}

template <typename Scalar>
using InputColumns = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

/// `values_si` [inputs x samples] within clamped_range. NaN, a lost value, stays NaN. Without
/// trained ranges nothing is clamped.
template <typename Scalar>
InputColumns<Scalar> clamped_inputs(const CalibrationModel& model, InputColumns<Scalar> values_si) {
  const ClampedRange range = clamped_range(model);
  for (Eigen::Index sample = 0; sample < values_si.cols(); ++sample) {
    for (Eigen::Index i = 0; i < range.low.size(); ++i) {
      Scalar& value = values_si(i, sample);
      value =
          std::clamp(value, static_cast<Scalar>(range.low[i]), static_cast<Scalar>(range.high[i]));
    }
  }
  return values_si;
}

/// clamped_inputs, then standardised; [inputs x samples].
template <typename Scalar>
InputColumns<Scalar> scaled_inputs(const CalibrationModel& model, InputColumns<Scalar> values_si) {
  values_si = clamped_inputs<Scalar>(model, std::move(values_si));
  const Eigen::Matrix<Scalar, Eigen::Dynamic, 1> mean = model.input.mean.cast<Scalar>();
  const Eigen::Matrix<Scalar, Eigen::Dynamic, 1> inverse_scale =
      model.input.scale.cwiseInverse().cast<Scalar>();
  standardise(mean, inverse_scale, values_si, values_si);
  return values_si;
}

}  // namespace ravencal::model
