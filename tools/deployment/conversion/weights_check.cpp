// SPDX-License-Identifier: Apache-2.0
#include "conversion/weights_check.hpp"

#include <algorithm>
#include <cmath>

#include "conversion/window.hpp"
#include "learn/evaluate.hpp"
#include "model/feature_matrix.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::conversion {
namespace {

constexpr Eigen::Index kBlockRows = 4096;  ///< bounds the memory of the hidden layers

bool is_clamped(const model::CalibrationModel& weights, const Eigen::RowVectorXf& features) {
  return model::clamped_inputs<float>(weights, features.transpose()) != features.transpose();
}

/// How many rows of the recording each sample of a window lies back, oldest first.
std::vector<Eigen::Index> rows_back(const model::CalibrationModel& model,
                                    const record::Recording& recording) {
  const std::size_t window = window_of(model);
  if (window == 1) return {0};
  const double period_s = model::row_period_s(recording);
  const double rows_per_row = period_s > 0.0 ? model.row_period_s / period_s : 1.0;
  const double stride = std::max(1.0, std::round(model.layers[1].stride_rows * rows_per_row));
  std::vector<Eigen::Index> back;
  for (std::size_t k = window; k-- > 0;) {
    back.push_back(static_cast<Eigen::Index>(k) * static_cast<Eigen::Index>(stride));
  }
  return back;
}

/// First row of the episode that each row belongs to: no window reaches behind it.
std::vector<Eigen::Index> episode_starts(const record::Recording& recording) {
  std::vector<Eigen::Index> starts(recording.t_ns.size(), 0);
  for (const record::Event& event : recording.events) {
    if (event.kind != "episode") continue;
    const auto first = std::lower_bound(recording.t_ns.begin(), recording.t_ns.end(), event.t_ns);
    const auto row = first - recording.t_ns.begin();
    std::fill(starts.begin() + row, starts.end(), row);
  }
  return starts;
}

using Predict = Eigen::MatrixXd (*)(const model::CalibrationModel&,
                                    std::span<const Eigen::MatrixXf>);

/// Joint errors, [rows x outputs]; what a row whose window is not whole gives means nothing.
Eigen::MatrixXd run(Predict predict, const model::CalibrationModel& model,
                    const model::FeatureMatrix& features, const std::vector<Eigen::Index>& back) {
  Eigen::MatrixXd result(features.rows(), static_cast<Eigen::Index>(model.outputs.size()));
  for (Eigen::Index first = 0; first < features.rows(); first += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, features.rows() - first);
    std::vector<Eigen::MatrixXf> samples;
    for (const Eigen::Index rows : back) {
      Eigen::MatrixXf sample(count, features.cols());
      for (Eigen::Index row = 0; row < count; ++row) {
        sample.row(row) = features.row(std::max<Eigen::Index>(first + row - rows, 0));
      }
      samples.push_back(std::move(sample));
    }
    result.middleRows(first, count) = predict(model, samples);
  }
  return result;
}

/// Confidence of each row, as the plugin computes it from what the network sees.
Eigen::VectorXf confidences(const model::CalibrationModel& weights,
                            const model::FeatureMatrix& features) {
  Eigen::VectorXf result = Eigen::VectorXf::Ones(features.rows());
  if (!weights.trust) return result;
  for (Eigen::Index row = 0; row < features.rows(); row += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, features.rows() - row);
    const Eigen::VectorXf distances = weights.trust->distances(
        model::scaled_inputs<float>(weights, features.middleRows(row, count).transpose()));
    for (Eigen::Index i = 0; i < count; ++i) {
      result[row + i] = weights.trust->confidence(distances[i]);
    }
  }
  return result;
}

/// The RMSE without a correction and the remaining one of both on the rows that have a truth.
void add_rmse(const record::Recording& recording, const model::OutputSpec& output,
              const std::vector<Eigen::Index>& rows, const Eigen::VectorXd& of_model,
              const Eigen::VectorXd& of_weights, JointCheck& joint) {
  const auto truth = recording.column(record::Role::kJointTruth, output.joint);
  const auto estimate = recording.column(output.estimate_channel);
  if (!truth || !estimate) return;
  std::vector<double> true_values;
  std::vector<double> uncorrected;
  std::vector<double> before;
  std::vector<double> after;
  for (const Eigen::Index row : rows) {
    const double true_value = recording.samples(row, *truth);
    const double raw = recording.samples(row, *estimate);
    if (!std::isfinite(true_value) || !std::isfinite(raw)) continue;
    true_values.push_back(true_value);
    uncorrected.push_back(raw);
    before.push_back(raw + of_model[row]);
    after.push_back(raw + of_weights[row]);
  }
  if (true_values.empty()) return;
  joint.model_rmse = learn::error_statistics(before, true_values, 0.0).rmse;
  joint.weights_rmse = learn::error_statistics(after, true_values, 0.0).rmse;
  joint.raw_rmse = learn::error_statistics(uncorrected, true_values, 0.0).rmse;
}

}  // namespace

std::optional<double> JointCheck::rmse_change_percent() const {
  if (!model_rmse || !weights_rmse) return std::nullopt;
  return 100.0 * (*weights_rmse / *model_rmse - 1.0);
}

bool JointCheck::is_worse_than_raw() const {
  return weights_rmse && raw_rmse && !(*weights_rmse <= *raw_rmse);
}

core::Result<WeightsCheck> check_weights(const model::CalibrationModel& model,
                                         const model::CalibrationModel& weights,
                                         const record::Recording& recording) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix seen,
                            model::feature_matrix(model.features, recording, model.row_period_s));
  RAVENCAL_ASSIGN_OR_RETURN(
      const model::FeatureMatrix used,
      model::feature_matrix(weights.features, recording, weights.row_period_s));
  const std::vector<Eigen::Index> back = rows_back(model, recording);
  const std::vector<Eigen::Index> starts = episode_starts(recording);
  const Eigen::MatrixXd exact = run(predict_exact, model, seen, back);
  const Eigen::MatrixXd in_f32 = run(predict_packed, model, seen, back);
  const Eigen::MatrixXd as_packed = run(predict_packed, weights, used, back);
  const Eigen::VectorXf trusted = confidences(weights, used);
  WeightsCheck check;
  for (const model::OutputSpec& output : model.outputs) {
    check.joints.push_back({output.joint, output.unit, 0.0, 0.0, {}, {}, {}});
  }
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < seen.rows(); ++row) {
    const bool whole = row - back.front() >= starts[static_cast<std::size_t>(row)];
    const auto is_finite = [&](Eigen::Index ago) { return seen.row(row - ago).allFinite(); };
    if (!whole || !std::all_of(back.begin(), back.end(), is_finite)) {
      ++check.rows_lost;
      continue;
    }
    rows.push_back(row);
    const bool clamped = std::any_of(back.begin(), back.end(), [&](Eigen::Index ago) {
      return is_clamped(model, seen.row(row - ago));
    });
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
