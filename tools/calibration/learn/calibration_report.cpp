// SPDX-License-Identifier: Apache-2.0
#include "learn/calibration_report.hpp"
#include "core/units.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace ravencal::learn {
namespace {

std::vector<double> scaled(const std::vector<double>& values, double factor) {
  std::vector<double> result(values.size());
  std::transform(values.begin(), values.end(), result.begin(),
                 [factor](double value) { return value * factor; });
  return result;
}

report::ErrorFigure figure(const ErrorStatistics& statistics, double per_si) {
  return {statistics.rmse * per_si, statistics.peak * per_si};
}

report::JointSeries series_of(const JointEvaluation& joint, const core::DisplayUnit& unit) {
  report::JointSeries series;
  series.joint = joint.joint;
  series.unit = unit.name;
  series.t_s = joint.t_s;
  series.truth = scaled(joint.truth, unit.per_si);
  series.raw = scaled(joint.estimate, unit.per_si);
  series.corrected = scaled(joint.corrected, unit.per_si);
  series.bias = -joint.bias * unit.per_si;  // the report's error is estimate - truth
  return series;
}

/// Appends to the table's note what the page shows no column of.
void note_motion(const JointEvaluation& joint, const core::DisplayUnit& unit, std::string& note) {
  if (!joint.motion || joint.motion->rows_beyond == 0) return;
  note += fmt::format(
      "{}{}: {:.1f} % of the rows are faster or under more load than in the training; calibrated "
      "RMSE {:.3g} {} on them, {:.3g} {} on the others.",
      note.empty() ? "" : " ", joint.joint,
      100.0 * static_cast<double>(joint.motion->rows_beyond) /
          static_cast<double>(joint.truth.size()),
      joint.motion->beyond_rmse * unit.per_si, unit.name, joint.motion->within_rmse * unit.per_si,
      unit.name);
}

/// Maps need two joints over the same rows.
void choose_maps(const Evaluation& evaluation, report::CalibrationReport& page) {
  const auto& joints = evaluation.joints;
  const bool equal = std::all_of(joints.begin(), joints.end(), [&](const JointEvaluation& joint) {
    return joint.truth.size() == joints.front().truth.size();
  });
  if (!equal || joints.size() < 2) return;
  const bool raven = joints.size() > 2;  // joints 2 and 3: elbow and insertion
  page.map_x_joint = joints[raven ? 1 : 0].joint;
  page.map_y_joint = joints[raven ? 2 : 1].joint;
}

report::LossCurve curve_of(std::span<const EpochReport> epochs, std::uint32_t kept_epoch) {
  report::LossCurve curve;
  curve.name = "training";
  for (const EpochReport& epoch : epochs) {
    curve.train.push_back(epoch.training);
    if (epoch.validation == epoch.validation) curve.validation.push_back(epoch.validation);
  }
  if (kept_epoch > 0) curve.kept_epoch = kept_epoch;
  return curve;
}

}  // namespace

report::CalibrationReport make_report(const model::CalibrationModel& model,
                                      const Evaluation& evaluation, const std::string& table_title,
                                      std::span<const EpochReport> epochs,
                                      std::uint32_t kept_epoch) {
  report::CalibrationReport page;
  page.title = "Joint calibration";
  report::ErrorTable table;
  table.title = table_title;
  if (evaluation.rows_without_feature > 0) {
    table.note = fmt::format("{} of {} rows are left out because a feature is lost.",
                             evaluation.rows_without_feature, evaluation.rows);
  }
  for (const std::string& sentence : sentences_of(evaluation.shared))
    table.note += fmt::format("{}{}.", table.note.empty() ? "" : " ", sentence);
  std::vector<std::string> words;
  for (const JointEvaluation& joint : evaluation.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    report::ErrorRow row;
    row.joint = joint.joint;
    row.unit = unit.name;
    row.samples = joint.truth.size();
    row.raw = figure(joint.raw, unit.per_si);
    row.bias_removed = figure(joint.bias_removed, unit.per_si);
    row.calibrated = figure(joint.calibrated, unit.per_si);
    table.rows.push_back(row);
    note_motion(joint, unit, table.note);
    page.series.push_back(series_of(joint, unit));
    words.push_back(fmt::format("{} from {:.3g} to {:.3g} {}", joint.joint, row.raw.rmse,
                                row.calibrated.rmse, unit.name));
  }
  page.tables.push_back(std::move(table));
  page.verdict =
      fmt::format("RMSE against the true joint, {}: {}.", table_title, fmt::join(words, "; "));
  for (const auto& [key, value] : model.provenance) page.provenance.emplace_back(key, value);
  choose_maps(evaluation, page);
  if (!epochs.empty()) page.losses.push_back(curve_of(epochs, kept_epoch));
  return page;
}

}  // namespace ravencal::learn
