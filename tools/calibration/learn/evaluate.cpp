// SPDX-License-Identifier: Apache-2.0
#include "learn/evaluate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "learn/dataset.hpp"
#include "learn/distance_rank.hpp"
#include "learn/motion_range.hpp"
#include "learn/recordings_at_hook.hpp"
#include "model/hook_view.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::learn {
namespace {

using record::Recording;
using record::Role;

/// Of every row, NaN where a feature is lost.
struct Predicted {
  Eigen::MatrixXd corrections;  ///< [rows x outputs]
  Eigen::VectorXd distances;    ///< of the inputs from the training; empty: unknown
};

core::Result<Predicted> predict(const model::CalibrationModel& model, const Recording& recording,
                                std::size_t& lost) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix features,
                            model::inputs_of(model, recording));
  Predicted result{
      Eigen::MatrixXd(features.rows(), static_cast<Eigen::Index>(model.outputs.size())),
      Eigen::VectorXd(model.trust ? features.rows() : 0)};
  constexpr Eigen::Index kRows = 4096;  // bounds the memory of the hidden layers
  for (Eigen::Index row = 0; row < features.rows(); row += kRows) {
    const Eigen::Index count = std::min(kRows, features.rows() - row);
    const Eigen::MatrixXd block = features.middleRows(row, count).cast<double>();
    result.corrections.middleRows(row, count) = model.predict(block);
    if (!model.trust) continue;
    const Eigen::MatrixXf scaled =
        model::scaled_inputs<float>(model, block.transpose().cast<float>());
    result.distances.segment(row, count) = model.trust->distances(scaled).cast<double>();
  }
  for (Eigen::Index row = 0; row < features.rows(); ++row) {
    if (features.row(row).allFinite()) continue;
    result.corrections.row(row).setConstant(std::nan(""));  // an activation may hide a NaN
    ++lost;
  }
  return result;
}

core::Status append(const model::CalibrationModel& model, const Recording& recording,
                    Evaluation& evaluation) {
  RAVENCAL_ASSIGN_OR_RETURN(const Predicted predicted,
                            predict(model, recording, evaluation.rows_without_feature));
  evaluation.rows += static_cast<std::size_t>(recording.rows());
  const RowFlags beyond =
      model.motion ? beyond_motion(*model.motion, model.outputs, recording) : RowFlags();
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    JointEvaluation& joint = evaluation.joints[k];
    const auto truth = recording.column(Role::kJointTruth, joint.joint);
    const auto estimate = recording.column(model.outputs[k].estimate_channel);
    if (!truth || !estimate) {
      return core::Error{
          core::ErrorCode::kData,
          fmt::format("{}: has no {} of joint {}, which the model corrects; the recording has the "
                      "truth of {} and the estimate of {}",
                      recording.source, estimate ? "truth" : "estimate", joint.joint,
                      joints_with(recording, Role::kJointTruth),
                      joints_with(recording, Role::kJointEstimate))};
    }
    for (Eigen::Index row = 0; row < recording.rows(); ++row) {
      const double corrected = recording.samples(row, *estimate) +
                               predicted.corrections(row, static_cast<Eigen::Index>(k));
      const double true_value = recording.samples(row, *truth);
      if (!std::isfinite(corrected) || !std::isfinite(true_value)) continue;
      const auto t_ns = recording.t_ns[static_cast<std::size_t>(row)] - recording.t_ns.front();
      joint.t_s.push_back(static_cast<double>(t_ns) * 1e-9);
      joint.truth.push_back(true_value);
      joint.estimate.push_back(recording.samples(row, *estimate));
      joint.corrected.push_back(corrected);
      if (model.trust) joint.distance.push_back(predicted.distances[row]);
      if (model.motion) joint.beyond.push_back(beyond(row, static_cast<Eigen::Index>(k)));
    }
  }
  return {};
}

/// Of the corrected values; a recording begins where the time falls.
double rmse_about_mean(const JointEvaluation& joint) {
  const Eigen::Map<const Eigen::ArrayXd> corrected(joint.corrected.data(), std::ssize(joint.truth));
  const Eigen::Map<const Eigen::ArrayXd> truth(joint.truth.data(), std::ssize(joint.truth));
  const Eigen::ArrayXd errors = corrected - truth;
  double squares = 0.0;
  Eigen::Index first = 0;
  for (Eigen::Index row = 1; row <= errors.size(); ++row) {
    const auto at = static_cast<std::size_t>(row);
    if (row < errors.size() && joint.t_s[at] >= joint.t_s[at - 1]) continue;
    const auto of_recording = errors.segment(first, row - first);
    squares += (of_recording - of_recording.mean()).square().sum();
    first = row;
  }
  return std::sqrt(squares / static_cast<double>(errors.size()));
}

MotionSplit split_of(const JointEvaluation& joint) {
  MotionSplit split;
  double squares[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < joint.truth.size(); ++i) {
    const double error = joint.corrected[i] - joint.truth[i];
    squares[joint.beyond[i] ? 1 : 0] += error * error;
    split.rows_beyond += joint.beyond[i] ? 1 : 0;
  }
  const std::size_t rows_within = joint.truth.size() - split.rows_beyond;
  split.within_rmse = std::sqrt(squares[0] / static_cast<double>(rows_within));
  split.beyond_rmse = std::sqrt(squares[1] / static_cast<double>(split.rows_beyond));
  return split;
}

double mean_confidence(const model::TrustRegion& trust, const std::vector<double>& distances) {
  double sum = 0.0;
  for (const double distance : distances)
    sum += static_cast<double>(trust.confidence(static_cast<float>(distance)));
  return sum / static_cast<double>(distances.size());
}

/// By how much of the raw RMSE the calibrated one is smaller; where nothing was wrong, nothing.
std::string fall_of(const JointEvaluation& joint) {
  if (!(joint.raw.rmse > 0.0)) return "-";
  return fmt::format("{:.1f} %", 100.0 * (1.0 - joint.calibrated.rmse / joint.raw.rmse));
}

/// Two columns of words and then numbers, each at least as wide as a usual table has it. A heading
/// may reach over the empty cell before it.
std::string aligned(const std::vector<std::vector<std::string>>& lines) {
  std::vector<std::size_t> widths = {12, 5, 9, 11, 9, 11, 9, 11, 9, 10};
  widths.resize(lines.front().size(), 9);
  for (const auto& line : lines) {
    for (std::size_t c = 0; c < widths.size(); ++c) {
      const bool reaches = c > 0 && line[c - 1].empty();
      if (!reaches) widths[c] = std::max(widths[c], line[c].size() + 1);
    }
  }
  std::string text;
  for (const auto& line : lines) {
    for (std::size_t c = 0; c < widths.size(); ++c) {
      const std::size_t next = c + 1 < widths.size() ? line[c + 1].size() : 0;
      const bool lends = line[c].empty() && next > widths[c + 1];
      const std::size_t width = widths[c] - (lends ? next - widths[c + 1] : 0);
      text += c < 2 ? fmt::format("{:<{}}", line[c], width) : fmt::format("{:>{}}", line[c], width);
    }
    text += "\n";
  }
  return text;
}

/// RMSE within and beyond the training's motion and the share of the rows beyond; a dash where none
/// are.
std::vector<std::string> motion_cells(const JointEvaluation& joint, double per_si) {
  if (!joint.motion) return {"-", "-", "-"};
  const auto rows = joint.truth.size();
  const auto beyond = joint.motion->rows_beyond;
  const auto rmse = [&](double value_si, std::size_t count) {
    return count > 0 ? fmt::format("{:.4f}", value_si * per_si) : "-";
  };
  return {rmse(joint.motion->within_rmse, rows - beyond), rmse(joint.motion->beyond_rmse, beyond),
          beyond > 0 ? fmt::format("{:.1f} %",
                                   100.0 * static_cast<double>(beyond) / static_cast<double>(rows))
                     : "-"};
}

nlohmann::ordered_json figures(const ErrorStatistics& statistics, double per_si) {
  return {{"rmse", statistics.rmse * per_si}, {"peak", statistics.peak * per_si}};
}

nlohmann::ordered_json expected_rmse_json(const model::ExpectedRmse& expected, double per_si) {
  return {{"rmse", expected.rmse * per_si},
          {"interval_95", {expected.low * per_si, expected.high * per_si}}};
}

}  // namespace

ErrorStatistics error_statistics(const std::vector<double>& values,
                                 const std::vector<double>& truth, double shift) {
  ErrorStatistics result;
  double squares = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double error = values[i] + shift - truth[i];
    squares += error * error;
    result.peak = std::max(result.peak, std::abs(error));
  }
  result.rmse = std::sqrt(squares / static_cast<double>(values.size()));
  return result;
}

void set_figures(JointEvaluation& joint) {
  joint.raw = error_statistics(joint.estimate, joint.truth, 0.0);
  joint.bias_removed = error_statistics(joint.estimate, joint.truth, joint.bias);
  joint.calibrated = error_statistics(joint.corrected, joint.truth, 0.0);
  joint.rmse_about_mean = rmse_about_mean(joint);
}

core::Result<Evaluation> evaluate(const model::CalibrationModel& model,
                                  std::span<const Recording* const> recordings) {
  Evaluation evaluation;
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    JointEvaluation joint;
    joint.joint = model.outputs[k].joint;
    joint.unit = model.outputs[k].unit;
    joint.bias = model.output.mean(static_cast<Eigen::Index>(k));
    if (!model.expected.empty()) joint.expected = model.expected[k];
    evaluation.joints.push_back(std::move(joint));
  }
  for (const Recording* recording : recordings) {
    RAVENCAL_RETURN_IF_ERROR(append(model, *recording, evaluation));
  }
  for (JointEvaluation& joint : evaluation.joints) {
    if (joint.truth.empty()) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("joint {}: no row of {} has its truth, its estimate and every "
                                     "feature",
                                     joint.joint, evaluation.rows)};
    }
    set_figures(joint);
    joint.distance_rank = distance_rank(joint);
    if (model.trust) joint.confidence = mean_confidence(*model.trust, joint.distance);
    if (model.motion) joint.motion = split_of(joint);
  }
  return evaluation;
}

std::string worse_than_raw(const std::string& joint, const std::string& unit_si, double rmse,
                           double raw_rmse) {
  const core::DisplayUnit unit = core::display_unit(unit_si);
  return fmt::format(
      "joint {}: calibrated is worse than raw, RMSE {:.4g} {} against {:.4g} {}; do not load this "
      "model for it",
      joint, rmse * unit.per_si, unit.name, raw_rmse * unit.per_si, unit.name);
}

std::vector<std::string> warnings_of(const Evaluation& evaluation) {
  std::vector<std::string> sentences;
  for (const JointEvaluation& joint : evaluation.joints) {
    if (!(joint.calibrated.rmse > joint.raw.rmse)) continue;
    sentences.push_back(
        worse_than_raw(joint.joint, joint.unit, joint.calibrated.rmse, joint.raw.rmse));
  }
  return sentences;
}

std::vector<std::string> warnings_of(const Evaluation& evaluation,
                                     const model::CalibrationModel& model,
                                     std::span<const Recording* const> recordings) {
  std::vector<std::string> sentences;
  if (evaluation.rows_without_feature > 0) {
    sentences.push_back(fmt::format("{} of {} rows are left out because a feature is lost",
                                    evaluation.rows_without_feature, evaluation.rows));
  }
  for (std::string& sentence : warnings_of(evaluation)) sentences.push_back(std::move(sentence));
  for (const Recording* recording : recordings) {
    if (!was_trained_on(model, *recording)) continue;
    sentences.push_back(
        fmt::format("{}: the model was trained on it, so this is no test", recording->source));
  }
  return sentences;
}

std::string evaluation_json(const Evaluation& evaluation) {
  nlohmann::ordered_json joints = nlohmann::ordered_json::array();
  for (const JointEvaluation& joint : evaluation.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    joints.push_back({{"joint", joint.joint},
                      {"unit", unit.name},
                      {"samples", joint.truth.size()},
                      {"raw", figures(joint.raw, unit.per_si)},
                      {"bias_removed", figures(joint.bias_removed, unit.per_si)},
                      {"calibrated", figures(joint.calibrated, unit.per_si)},
                      {"rmse_about_mean", joint.rmse_about_mean * unit.per_si}});
    if (!joint.distance.empty()) joints.back()["confidence"] = joint.confidence;
    if (std::isfinite(joint.distance_rank)) joints.back()["distance_rank"] = joint.distance_rank;
    if (joint.motion) {
      joints.back()["within_trained_motion"] = {
          {"samples", joint.truth.size() - joint.motion->rows_beyond},
          {"rmse", joint.motion->within_rmse * unit.per_si}};
      joints.back()["beyond_trained_motion"] = {{"samples", joint.motion->rows_beyond},
                                                {"rmse", joint.motion->beyond_rmse * unit.per_si}};
    }
    if (!joint.expected) continue;
    nlohmann::ordered_json expected = expected_rmse_json(joint.expected->any(), unit.per_si);
    expected["rmse_about_mean"] = joint.expected->about_mean * unit.per_si;
    expected["same_homing"] = expected_rmse_json(joint.expected->same_homing, unit.per_si);
    expected["other_homing"] = nullptr;
    if (joint.expected->other_homing)
      expected["other_homing"] = expected_rmse_json(*joint.expected->other_homing, unit.per_si);
    joints.back()["expected"] = std::move(expected);
  }
  nlohmann::ordered_json json = {{"joints", joints}};
  const SharedSeeds& shared = evaluation.shared;
  if (!shared.runs.empty()) json["same_seed"] = shared_seeds_json(shared.runs);
  if (!shared.homings.empty()) json["one_homing"] = shared_seeds_json(shared.homings);
  return json.dump(2) + "\n";
}

std::string evaluation_table(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> lines = {
      {"joint", "unit", "samples", "", "raw", "", "bias removed", "", "calibrated", "fall"},
      {"", "", "", "RMSE", "peak", "RMSE", "peak", "RMSE", "peak", "of RMSE"}};
  const bool has_motion =
      std::any_of(evaluation.joints.begin(), evaluation.joints.end(),
                  [](const JointEvaluation& joint) { return joint.motion.has_value(); });
  const auto extend = [&](std::vector<std::string>& line, const std::vector<std::string>& cells) {
    if (has_motion) line.insert(line.end(), cells.begin(), cells.end());
  };
  extend(lines[0], {"", "trained motion", "rows"});
  extend(lines[1], {"within", "beyond", "beyond"});
  for (const JointEvaluation& joint : evaluation.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    const bool has_rows = !joint.truth.empty();  // a loop may know no truth
    std::vector<std::string>& line = lines.emplace_back();
    line = {joint.joint, std::string(unit.name), std::to_string(joint.truth.size())};
    for (const ErrorStatistics& s : {joint.raw, joint.bias_removed, joint.calibrated}) {
      line.push_back(has_rows ? fmt::format("{:.4f}", s.rmse * unit.per_si) : "-");
      line.push_back(has_rows ? fmt::format("{:.4f}", s.peak * unit.per_si) : "-");
    }
    line.push_back(fall_of(joint));
    extend(line, motion_cells(joint, unit.per_si));
  }
  std::string text = aligned(lines);
  for (const std::string& sentence : sentences_of(evaluation.shared)) text += sentence + "\n";
  return text;
}

}  // namespace ravencal::learn
