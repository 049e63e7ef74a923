// SPDX-License-Identifier: Apache-2.0
#include "study/ablation_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/units.hpp"
#include "learn/evaluate.hpp"

namespace ravencal::study {
namespace {

constexpr const char* kTheirs =
    "theirs: arXiv 2302.04999, their robot, their network (raw and bias removed to two digits)";
constexpr const char* kMarkNote =
    "Mean over seeds ± standard deviation over seeds, with its 95 % interval (bootstrap over "
    "blocks "
    "of time and over seeds). Marked: more than 30 % above no ablation, as in the paper.";

/// RMSE of shoulder (deg), elbow (deg), insertion (mm) that arXiv 2302.04999 states.
struct Published {
  std::string_view condition;
  std::string_view test;
  std::array<double, 3> figures;
};
constexpr Published kPublished[] = {{"unloaded", kRaw, {2.1, 7.9, 11.7}},
                                    {"unloaded", kBias, {0.93, 1.10, 0.53}},
                                    {"unloaded", kNoAblation, {0.3003, 0.2888, 0.1565}},
                                    {"500 g", kNoAblation, {0.4456, 0.3052, 0.1900}}};

double published(const ConditionResults& results, const RowId& row, std::size_t joint) {
  constexpr std::array<std::string_view, 3> kJoints = {"shoulder", "elbow", "insertion"};
  if (row.network != kNoAblation || joint >= kJoints.size()) return kUnknown;
  if (results.joints()[joint].name != kJoints[joint]) return kUnknown;
  for (const Published& entry : kPublished) {
    if (entry.condition == results.condition().title && entry.test == row.test) {
      return entry.figures[joint];
    }
  }
  return kUnknown;
}

Cell cell_of(const ConditionResults& results, const Tested& row, std::size_t joint,
             const std::optional<Tested>& reference) {
  Cell cell;
  if (!results.has(row.row)) return cell;
  const double per_si = core::display_unit(results.joints()[joint].unit).per_si;
  const Figure figure = results.rmse(row, joint);
  cell.mean = figure.mean * per_si;
  const bool trained = row.row.test != kRaw && row.row.test != kBias;
  if (trained) cell.deviation = figure.deviation * per_si;
  cell.low = figure.interval.low * per_si;
  cell.high = figure.interval.high * per_si;
  if (!std::isfinite(cell.mean)) cell.text = "overflow";
  if (reference && results.has(reference->row) &&
      figure.mean > kMarkedRatio * results.rmse(*reference, joint).mean) {
    cell.mark = Mark::kWorse;
  }
  return cell;
}

/// Rows by conditions and joints, for the conditions of one study.
class TableBuilder {
 public:
  TableBuilder(std::string id, std::string title, std::string row_title, const Results& results) {
    table_.id = std::move(id);
    table_.title = std::move(title);
    table_.row_title = std::move(row_title);
    table_.note = kMarkNote;
    table_.theirs_label = kTheirs;
    for (const ConditionResults& condition : results.conditions) {
      if (condition.condition().homing) continue;
      conditions_.push_back(&condition);
      for (const JointName& joint : condition.joints()) {
        table_.columns.push_back(
            {joint.name, core::display_unit(joint.unit).name, condition.condition().title, -1});
      }
    }
  }

  /// Adds the row unless no condition has it.
  void add(const std::string& title, const RowId& row, bool rule_above, bool may_be_marked) {
    Row line{title, {}, rule_above || (rule_next_ && !table_.rows.empty())};
    bool any = false;
    const Tested none{RowId{}, {}};
    for (const ConditionResults* condition : conditions_) {
      any = any || condition->has(row);
      for (std::size_t joint = 0; joint < condition->joints().size(); ++joint) {
        line.cells.push_back(cell_of(*condition, {row, {}}, joint,
                                     may_be_marked ? std::optional(none) : std::nullopt));
        line.cells.back().theirs = published(*condition, row, joint);
      }
    }
    rule_next_ = any ? false : line.rule_above;
    if (any) table_.rows.push_back(std::move(line));
  }

  void add_baselines() {
    add("before calibration", {std::string(kNoAblation), std::string(kRaw)}, false, false);
    add("bias removal", {std::string(kNoAblation), std::string(kBias)}, false, false);
    add("no ablation", RowId{}, true, false);
  }

  [[nodiscard]] bool empty() const { return conditions_.empty() || table_.rows.empty(); }
  Table take() { return std::move(table_); }

 private:
  Table table_;
  std::vector<const ConditionResults*> conditions_;
  bool rule_next_ = false;  ///< a row with a rule above it was left out
};

/// Starts a part of a table with a rule where the features' kind changes.
bool starts_part(const FeatureSet& set) { return set.id == kAllPoses || set.id == "joint_1"; }

Table removal_table(const Results& results) {
  TableBuilder builder("removal", "Removal ablation: RMSE of networks trained without", "without",
                       results);
  builder.add_baselines();
  bool first = true;
  for (const FeatureSet& set : ablated_sets()) {
    builder.add(set.title, {set.id, std::string(kNoAblation)}, first || starts_part(set), true);
    first = false;
  }
  return builder.take();
}

Table inaccurate_table(const Results& results) {
  TableBuilder builder(
      "inaccurate",
      "Inaccurate ablation: RMSE with uniform noise of ± one standard deviation of "
      "the training rows, added at test only",
      "noise on", results);
  builder.add_baselines();
  bool first = true;
  for (const FeatureSet& set : ablated_sets()) {
    builder.add(set.title, {std::string(kNoAblation), variant_id(Noise::kDeviation, set.id)},
                first || starts_part(set), true);
    first = false;
  }
  return builder.take();
}

Table noise_kinds_table(const Results& results) {
  TableBuilder builder("noise_kinds", "Other kinds of inaccuracy, at test only", "spoilt", results);
  builder.add("no ablation", RowId{}, false, false);
  for (const FeatureSet& set : grouped_sets()) {
    bool first = true;
    for (const Noise noise : kOtherNoises) {
      builder.add(fmt::format("{}, {}", set.title, title_of(noise)),
                  {std::string(kNoAblation), variant_id(noise, set.id)}, first, true);
      first = false;
    }
  }
  return builder.take();
}

Table torque_table(const Results& results) {
  TableBuilder builder("torque", "Torque ablation: RMSE with torques changed at test only",
                       "changed", results);
  builder.add("none", RowId{}, false, false);
  for (const FeatureSet& set : torque_sets()) {
    bool first = true;
    for (const Noise noise : kTorqueNoises) {
      builder.add(fmt::format("{}, {}", set.title, title_of(noise)),
                  {std::string(kNoAblation), variant_id(noise, set.id)}, first, true);
      first = false;
    }
  }
  return builder.take();
}

struct HomingRow {
  std::string title;
  RowId row;
};

std::vector<HomingRow> homing_rows() {
  const std::string none(kNoAblation);
  std::vector<HomingRow> rows = {{"all features", {std::string(kAllFeatures), none}}};
  for (const FeatureSet& set : homing_sets()) rows.push_back({set.title, {set.id, none}});
  rows.push_back({"only encoder values and offsets", {std::string(kOnlyEncoder), none}});
  rows.push_back({"all features, encoder inaccurate",
                  {std::string(kAllFeatures), variant_id(Noise::kDeviation, kNoEncoder)}});
  return rows;
}

/// One table per condition: joints as groups, homings as columns.
Table homing_table(const ConditionResults& results, std::size_t index) {
  Table table;
  table.id = fmt::format("homing_{}", index);
  table.title =
      fmt::format("Re-homing, {}: RMSE by homings since training", results.condition().title);
  table.row_title = "trained with";
  table.note =
      "Mean over seeds ± standard deviation over seeds, with its 95 % interval. Marked: more "
      "than 30 % above the same network before any homing.";
  const std::size_t tests = results.condition().test.size();
  for (const JointName& joint : results.joints()) {
    const std::string unit = core::display_unit(joint.unit).name;
    for (std::size_t i = 0; i < tests; ++i) {
      table.columns.push_back(
          {fmt::format("{}", i), "", fmt::format("{} [{}]", joint.name, unit), -1});
    }
  }
  for (const HomingRow& line : homing_rows()) {
    if (!results.has(line.row)) continue;
    Row row{line.title, {}, false};
    for (std::size_t joint = 0; joint < results.joints().size(); ++joint) {
      for (std::size_t i = 0; i < tests; ++i) {
        row.cells.push_back(cell_of(results, {line.row, i}, joint, Tested{line.row, 0}));
      }
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// How much each joint's figures rest on: samples, and what they are worth.
Table samples_table(const Results& results) {
  Table table;
  table.id = "samples";
  table.title = "What the figures rest on";
  table.row_title = "condition, joint";
  table.note =
      "Neighbouring samples are alike: as far as the mean squared error goes, the test's samples "
      "are "
      "worth so many independent ones (all features, first seed).";
  table.columns = {{"test samples", "", "", 0},
                   {"effective samples", "", "", 0},
                   {"correlation time", "s", "", 1}};
  for (const ConditionResults& condition : results.conditions) {
    RowId row;
    if (!condition.has(row)) row.network = kAllFeatures;
    if (!condition.has(row)) continue;
    for (std::size_t joint = 0; joint < condition.joints().size(); ++joint) {
      double samples = 0.0;
      double effective = 0.0;
      double longest_s = 0.0;
      for (std::size_t i = 0; i < condition.condition().test.size(); ++i) {
        const ErrorBlocks& blocks = condition.first_seed(row, joint, i);
        samples += blocks.samples();
        effective += blocks.effective_samples;
        longest_s = std::max(longest_s, blocks.correlation_s);
      }
      Row line{condition.condition().title + ", " + condition.joints()[joint].name, {}, joint == 0};
      for (const double value : {samples, effective, longest_s}) {
        line.cells.emplace_back().mean = value;
      }
      table.rows.push_back(std::move(line));
    }
  }
  return table;
}

}  // namespace

std::vector<Table> ablation_tables(const Plan& plan, const Results& results) {
  std::vector<Table> tables;
  const auto add = [&](Table table) {
    if (!table.rows.empty() && !table.columns.empty()) tables.push_back(std::move(table));
  };
  if (includes(plan, "removal")) add(removal_table(results));
  if (includes(plan, "inaccurate")) {
    add(inaccurate_table(results));
    add(noise_kinds_table(results));
  }
  if (includes(plan, "torque")) add(torque_table(results));
  for (std::size_t i = 0; i < results.conditions.size(); ++i) {
    if (results.conditions[i].condition().homing) add(homing_table(results.conditions[i], i));
  }
  add(samples_table(results));
  return tables;
}

}  // namespace ravencal::study
