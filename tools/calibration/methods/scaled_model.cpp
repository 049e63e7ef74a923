// SPDX-License-Identifier: Apache-2.0
#include "methods/scaled_model.hpp"

#include <numeric>

#include "core/version.hpp"
#include "learn/dataset.hpp"
#include "model/layers.hpp"
#include "model/trust_fit.hpp"

namespace ravencal::methods {

model::CalibrationModel frame_of(const Problem& problem, const std::vector<Eigen::Index>& columns,
                                 const Stack& data) {
  model::CalibrationModel frame;
  for (const Eigen::Index column : columns)
    frame.features.push_back(problem.features[static_cast<std::size_t>(column)]);
  frame.outputs = problem.outputs;
  frame.row_period_s = problem.row_period_s;
  const Eigen::MatrixXd inputs = data.inputs(Eigen::all, columns);
  frame.input = learn::fit_scaling(Eigen::Ref<const Eigen::MatrixXd>(inputs)).standardiser;
  frame.output = learn::fit_scaling(Eigen::Ref<const Eigen::MatrixXd>(data.errors)).standardiser;
  frame.input_min = inputs.colwise().minCoeff().transpose();
  frame.input_max = inputs.colwise().maxCoeff().transpose();
  frame.trust = model::fit_trust_region(frame.input, inputs.cast<float>());
  frame.provenance["ravencal_version"] = core::kVersion;
  return frame;
}

std::vector<Eigen::Index> first_columns(Eigen::Index count) {
  std::vector<Eigen::Index> columns(static_cast<std::size_t>(count));
  std::iota(columns.begin(), columns.end(), Eigen::Index{0});
  return columns;
}

Eigen::MatrixXd scaled_inputs(const model::CalibrationModel& frame, const Stack& data) {
  const Eigen::Index count = frame.input.mean.size();
  Eigen::MatrixXd scaled(count, data.inputs.rows());
  const Eigen::VectorXd inverse = frame.input.scale.cwiseInverse();
  model::standardise(frame.input.mean, inverse, data.inputs.leftCols(count).transpose(), scaled);
  return scaled;
}

Eigen::MatrixXd scaled_errors(const model::CalibrationModel& frame, const Stack& data) {
  Eigen::MatrixXd scaled(data.errors.cols(), data.errors.rows());
  const Eigen::VectorXd inverse = frame.output.scale.cwiseInverse();
  model::standardise(frame.output.mean, inverse, data.errors.transpose(), scaled);
  return scaled;
}

}  // namespace ravencal::methods
