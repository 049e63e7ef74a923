// SPDX-License-Identifier: Apache-2.0
#include "learn/dataset.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "model/trust_fit.hpp"

namespace ravencal::learn {
namespace {

using record::Recording;
using record::Role;

/// Population mean and standard deviation, two passes.
template <typename Values>
Scaling scaling_of(const Values& values) {
  const Eigen::Index columns = values.cols();
  const auto rows = static_cast<double>(values.rows());
  Scaling result;
  result.standardiser.mean.resize(columns);
  result.standardiser.scale.resize(columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    const Eigen::VectorXd column = values.col(c).template cast<double>();
    double mean = column.sum() / rows;
    double scale = std::sqrt((column.array() - mean).square().sum() / rows);
    // Inputs are single precision, 6e-8 of the value: smaller spreads are rounding, not signal.
    constexpr double kResolution = 1e-6;
    const bool constant = column.minCoeff() == column.maxCoeff();
    if (constant) mean = column(0);
    if (constant || scale < kResolution * std::abs(mean)) {
      scale = 1.0;
      result.constant.push_back(c);
    }
    result.standardiser.mean(c) = mean;
    result.standardiser.scale(c) = scale;
  }
  return result;
}

}  // namespace

core::Result<Eigen::MatrixXd> joint_errors(std::span<const model::OutputSpec> outputs,
                                           const Recording& recording) {
  Eigen::MatrixXd errors(recording.rows(), static_cast<Eigen::Index>(outputs.size()));
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const auto truth = recording.column(Role::kJointTruth, outputs[k].joint);
    const auto estimate = recording.column(outputs[k].estimate_channel);
    if (!truth || !estimate) {
      return core::data_error(fmt::format("{}: has no {} of joint {}", recording.source,
                                          truth ? "estimate" : "truth", outputs[k].joint));
    }
    errors.col(static_cast<Eigen::Index>(k)) =
        recording.samples.col(*truth) - recording.samples.col(*estimate);
  }
  return errors;
}

std::string joints_with(const Recording& recording, Role role) {
  std::vector<std::string> joints;
  for (const record::Channel& channel : recording.channels) {
    if (channel.role == role) joints.push_back(channel.joint);
  }
  return joints.empty() ? "no joint" : fmt::format("{}", fmt::join(joints, ", "));
}

core::Result<std::vector<model::OutputSpec>> outputs_of(const Recording& recording,
                                                        std::span<const std::string> joints) {
  const std::vector<std::string> present = recording.calibratable_joints();
  if (present.empty()) {
    return core::data_error(fmt::format(
        "{}: no joint has both an estimate and a truth: the recording has the truth of {} and the "
        "estimate of {}. Joints go by their names; the truth comes from external encoders "
        "(`ravencal merge`) or from a channel of role joint_truth in the profile",
        recording.source, joints_with(recording, Role::kJointTruth),
        joints_with(recording, Role::kJointEstimate)));
  }
  for (const std::string& joint : joints) {
    if (std::find(present.begin(), present.end(), joint) == present.end()) {
      return core::data_error(fmt::format("{}: joint '{}' has no truth; those that have are {}",
                                          recording.source, joint, fmt::join(present, ", ")));
    }
  }
  std::vector<model::OutputSpec> outputs;
  for (const std::string& joint : present) {
    if (!joints.empty() && std::find(joints.begin(), joints.end(), joint) == joints.end()) continue;
    const auto column = static_cast<std::size_t>(*recording.column(Role::kJointEstimate, joint));
    outputs.push_back({joint, recording.channels[column].name, recording.channels[column].unit});
  }
  return outputs;
}

core::Result<Dataset> make_dataset(std::span<const model::FeatureSpec> features,
                                   std::span<const model::OutputSpec> outputs,
                                   std::span<const Recording* const> recordings,
                                   double row_period_s, const RowChoice& choice) {
  Eigen::Index capacity = 0;
  for (const Recording* recording : recordings)
    capacity += (recording->rows() + choice.stride - 1) / choice.stride;
  Dataset dataset;
  dataset.features.resize(capacity, static_cast<Eigen::Index>(features.size()));
  dataset.errors.resize(capacity, static_cast<Eigen::Index>(outputs.size()));
  Eigen::Index kept = 0;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    RAVENCAL_ASSIGN_OR_RETURN(const Eigen::MatrixXd errors, joint_errors(outputs, *recordings[r]));
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix inputs,
                              model::feature_matrix(features, *recordings[r], row_period_s));
    for (Eigen::Index row = 0; row < recordings[r]->rows(); row += choice.stride) {
      const auto known = errors.row(row).array().isFinite();
      if (!(choice.some_truth ? known.any() : known.all())) {
        ++dataset.rows_without_truth;
      } else if (!inputs.row(row).allFinite()) {
        ++dataset.rows_without_feature;
      } else {
        dataset.features.row(kept) = inputs.row(row);
        dataset.errors.row(kept) = errors.row(row);
        dataset.origins.push_back({r, row});
        ++kept;
      }
    }
  }
  dataset.features.conservativeResize(kept, Eigen::NoChange);
  dataset.errors.conservativeResize(kept, Eigen::NoChange);
  if (kept > 0 || choice.some_truth) return dataset;
  return core::data_error(fmt::format(
      "{}: no usable row is left of {}: {} lack the truth or the estimate of a joint, {} lack a "
      "feature; `ravencal info` shows which channels are lost, --features and --joints leave them "
      "out",
      recordings.empty() ? "no recording" : recordings.front()->source, capacity,
      dataset.rows_without_truth, dataset.rows_without_feature));
}

core::Status check_row_count(const std::string& what, Eigen::Index rows, Eigen::Index inputs) {
  if (rows >= kFewestRows && rows > inputs) return {};
  const bool are_inputs_many = inputs >= kFewestRows;
  return core::data_error(fmt::format(
      "{}: {} usable row(s) are too few to train on; at least {} are needed{}: give longer "
      "recordings{}",
      what, rows, std::max(kFewestRows, inputs + 1),
      are_inputs_many ? fmt::format(" for {} inputs", inputs) : "",
      are_inputs_many ? ", or fewer --features" : ""));
}

Scaling fit_scaling(const Eigen::Ref<const Eigen::MatrixXd>& values) { return scaling_of(values); }

Scaling fit_scaling(const model::FeatureMatrix& values) { return scaling_of(values); }

std::vector<Eigen::Index> fit_inputs(const model::FeatureMatrix& inputs,
                                     model::CalibrationModel& model) {
  Scaling scaling = fit_scaling(inputs);
  model.input = std::move(scaling.standardiser);
  model.input_min = inputs.colwise().minCoeff().transpose().cast<double>();
  model.input_max = inputs.colwise().maxCoeff().transpose().cast<double>();
  model.trust = model::fit_trust_region(model.input, inputs);
  return scaling.constant;
}

}  // namespace ravencal::learn
