// SPDX-License-Identifier: Apache-2.0
#include "conversion/weights_check.hpp"

#include <algorithm>
#include <cmath>

#include "learn/evaluate.hpp"
#include "model/feature_matrix.hpp"
#include "model/input_limits.hpp"
#include "model/single_precision.hpp"

namespace ravencal::conversion {
namespace {

constexpr Eigen::Index kBlockRows = 4096;  ///< bounds the memory of the hidden layers

bool is_clamped(const model::CalibrationModel& weights, const Eigen::RowVectorXf& features) {
  for (Eigen::Index i = 0; i < features.size(); ++i) {
    const auto limits = model::input_limits(weights.input_min[i], weights.input_max[i]);
    if (features[i] < limits.low || features[i] > limits.high) return true;
  }
  return false;
}

/// Joint errors as the plugin computes them, [rows x outputs].
Eigen::MatrixXd run_single(const model::CalibrationModel& weights,
                           const model::FeatureMatrix& features) {
  Eigen::MatrixXd result(features.rows(), static_cast<Eigen::Index>(weights.outputs.size()));
  for (Eigen::Index row = 0; row < features.rows(); row += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, features.rows() - row);
    const Eigen::MatrixXf block = features.middleRows(row, count).transpose();
    result.middleRows(row, count) =
        model::predict_single(weights, block).transpose().cast<double>();
  }
  return result;
}

/// Confidence of each row, as the plugin computes it from what the network sees.
Eigen::VectorXf confidences(const model::CalibrationModel& weights,
                            const model::FeatureMatrix& features) {
  Eigen::VectorXf result = Eigen::VectorXf::Ones(features.rows());
  if (!weights.trust) return result;
  Eigen::VectorXf low(features.cols());
  Eigen::VectorXf high(features.cols());
  for (Eigen::Index i = 0; i < features.cols(); ++i) {
    const auto limits = model::input_limits(weights.input_min[i], weights.input_max[i]);
    low[i] = limits.low;
    high[i] = limits.high;
  }
  const Eigen::VectorXf mean = weights.input.mean.cast<float>();
  const Eigen::VectorXf inverse_scale = weights.input.scale.cwiseInverse().cast<float>();
  for (Eigen::Index row = 0; row < features.rows(); row += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, features.rows() - row);
    const Eigen::MatrixXf block = features.middleRows(row, count)
                                      .transpose()
                                      .cwiseMax(low.replicate(1, count))
                                      .cwiseMin(high.replicate(1, count));
    const Eigen::MatrixXf scaled =
        ((block.colwise() - mean).array().colwise() * inverse_scale.array()).matrix();
    const Eigen::VectorXf distances = weights.trust->distances(scaled);
    for (Eigen::Index i = 0; i < count; ++i) {
      result[row + i] = weights.trust->confidence(distances[i]);
    }
  }
  return result;
}

/// The remaining RMSE of both on the rows that have a truth.
void add_rmse(const record::Recording& recording, const model::OutputSpec& output,
              const std::vector<Eigen::Index>& rows, const Eigen::VectorXd& of_model,
              const Eigen::VectorXd& of_weights, JointCheck& joint) {
  const auto truth = recording.column(record::Role::kJointTruth, output.joint);
  const auto estimate = recording.column(output.estimate_channel);
  if (!truth || !estimate) return;
  std::vector<double> true_values;
  std::vector<double> before;
  std::vector<double> after;
  for (const Eigen::Index row : rows) {
    const double true_value = recording.samples(row, *truth);
    const double raw = recording.samples(row, *estimate);
    if (!std::isfinite(true_value) || !std::isfinite(raw)) continue;
    true_values.push_back(true_value);
    before.push_back(raw + of_model[row]);
    after.push_back(raw + of_weights[row]);
  }
  if (true_values.empty()) return;
  joint.model_rmse = learn::error_statistics(before, true_values, 0.0).rmse;
  joint.weights_rmse = learn::error_statistics(after, true_values, 0.0).rmse;
}

}  // namespace

std::optional<double> JointCheck::rmse_change_percent() const {
  if (!model_rmse || !weights_rmse) return std::nullopt;
  return 100.0 * (*weights_rmse / *model_rmse - 1.0);
}

core::Result<WeightsCheck> check_weights(const model::CalibrationModel& model,
                                         const model::CalibrationModel& weights,
                                         const record::Recording& recording) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix seen,
                            model::feature_matrix(model.features, recording, model.row_period_s));
  RAVENCAL_ASSIGN_OR_RETURN(
      const model::FeatureMatrix used,
      model::feature_matrix(weights.features, recording, weights.row_period_s));
  const Eigen::MatrixXd exact = model.predict(seen.cast<double>());
  const Eigen::MatrixXd in_f32 = run_single(model, seen);
  const Eigen::MatrixXd as_packed = run_single(weights, used);
  const Eigen::VectorXf trusted = confidences(weights, used);
  WeightsCheck check;
  for (const model::OutputSpec& output : model.outputs) {
    check.joints.push_back({output.joint, output.unit, 0.0, 0.0, {}, {}});
  }
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < seen.rows(); ++row) {
    if (!seen.row(row).allFinite()) {
      ++check.rows_lost;
      continue;
    }
    rows.push_back(row);
    const bool clamped = is_clamped(model, seen.row(row));
    check.rows_clamped += clamped ? 1 : 0;
    check.rows_trusted += trusted[row] >= 1.0F ? 1 : 0;
    check.rows_doubted += trusted[row] <= 0.0F ? 1 : 0;
    for (std::size_t k = 0; k < check.joints.size(); ++k) {
      const auto j = static_cast<Eigen::Index>(k);
      JointCheck& joint = check.joints[k];
      double& largest = clamped ? joint.largest_clamped_difference : joint.largest_difference;
      largest = std::max(largest, std::abs(exact(row, j) - as_packed(row, j)));
    }
  }
  check.rows = rows.size();
  for (std::size_t k = 0; k < check.joints.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    add_rmse(recording, model.outputs[k], rows, in_f32.col(j), as_packed.col(j), check.joints[k]);
  }
  return check;
}

}  // namespace ravencal::conversion
