// SPDX-License-Identifier: Apache-2.0
#include "study/ablation_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/units.hpp"
#include "study/paper_figures.hpp"

namespace ravencal::study {
namespace {

constexpr const char* kTheirs = "the paper's: arXiv 2302.04999, its robot, its network";
constexpr const char* kMarkNote =
    "RMSE and peak (largest error) per joint. Mean over seeds ± standard deviation over seeds; the "
    "RMSE's 95 % interval is of a bootstrap over blocks of time and over seeds. Marked: more than "
    "30 % above no ablation, as in the paper.";
constexpr const char* kReleasedNote =
    "The authors' notebooks add the noise in place to the test rows, of which the believed "
    "positions of joints 1 and 2 are views and that of joint 3, converted to metres, is a copy. So "
    "the noise is also in the angles that the correction is added to. Uniform noise within ± d has "
    "an RMS of d / √3 and a peak of d: over a range of 40°, evenly filled, d = 40° / √12 = 11.55°, "
    "RMS 6.67°, peak 11.55°, and the network's own error beside it. The paper has 6.71° and 12.26° "
    "at joint 1: what it says of inaccurate joint poses there is this sum, not the network's "
    "sensitivity to its inputs, which the table of the inputs alone shows.";

struct CellOf {
  std::size_t joint = 0;
  bool peak = false;
};

Cell cell_of(const ConditionResults& results, const Tested& row, CellOf which,
             const std::optional<Tested>& reference) {
  Cell cell;
  if (!results.has(row.row)) return cell;
  const auto figure_of = [&](const Tested& tested) {
    return which.peak ? results.peak(tested, which.joint) : results.rmse(tested, which.joint);
  };
  const double per_si = core::display_unit(results.joints()[which.joint].unit).per_si;
  const Figure figure = figure_of(row);
  cell.mean = figure.mean * per_si;
  const bool trained = row.row.test != kRaw && row.row.test != kBias;
  if (trained) cell.deviation = figure.deviation * per_si;
  cell.low = figure.interval.low * per_si;
  cell.high = figure.interval.high * per_si;
  if (!std::isfinite(cell.mean)) cell.text = "overflow";
  if (reference && results.has(reference->row) &&
      figure.mean > kMarkedRatio * figure_of(*reference).mean) {
    cell.mark = Mark::kWorse;
  }
  return cell;
}

/// RMSE and peak of each joint, below the heading `group`.
void add_columns(Table& table, const std::vector<JointName>& joints, const std::string& group) {
  for (const JointName& joint : joints) {
    const std::string unit = core::display_unit(joint.unit).name;
    table.columns.push_back({joint.name, unit, group, -1});
    table.columns.push_back({joint.name + std::string(kPeakColumn), unit, group, -1});
  }
}

/// The cells of add_columns(); `paper_row` names the paper's figures beside them.
std::vector<Cell> cells_of(const ConditionResults& results, const RowId& row,
                           const std::optional<RowId>& reference, PaperTable paper,
                           std::string_view paper_row) {
  std::vector<Cell> cells;
  for (std::size_t joint = 0; joint < results.joints().size(); ++joint) {
    for (const bool peak : {false, true}) {
      std::optional<Tested> against;
      if (reference) against = Tested{*reference, {}};
      cells.push_back(cell_of(results, {row, {}}, {joint, peak}, against));
      cells.back().theirs = paper_figure(paper, results.condition().title, paper_row,
                                         results.joints()[joint].name, peak);
    }
  }
  return cells;
}

/// Beneath a table that shows the condition: which of its tests the training saw in part.
void note_shared_seeds(const ConditionResults& results, Table& table) {
  for (const std::string& sentence : learn::sentences_of(results.condition().shared)) {
    if (table.note.find(sentence) == std::string::npos) table.note += " " + sentence + ".";
  }
}

/// Rows by conditions and joints, for the conditions of one study.
class TableBuilder {
 public:
  TableBuilder(std::string id, std::string title, std::string row_title, PaperTable paper,
               const Results& results)
      : paper_(paper) {
    table_.id = std::move(id);
    table_.title = std::move(title);
    table_.row_title = std::move(row_title);
    table_.note = kMarkNote;
    table_.theirs_label = kTheirs;
    for (const ConditionResults& condition : results.conditions) {
      if (condition.condition().homing) continue;
      conditions_.push_back(&condition);
      add_columns(table_, condition.joints(), condition.condition().title);
      note_shared_seeds(condition, table_);
    }
  }

  /// Adds the row unless no condition has it. `paper_row` is empty where the paper has no such row.
  void add(const std::string& title, const RowId& row, std::string_view paper_row, bool rule_above,
           bool may_be_marked) {
    Row line{title, {}, rule_above || (rule_next_ && !table_.rows.empty())};
    bool any = false;
    for (const ConditionResults* condition : conditions_) {
      any = any || condition->has(row);
      std::vector<Cell> cells =
          cells_of(*condition, row, may_be_marked ? std::optional(RowId{}) : std::nullopt, paper_,
                   paper_row);
      line.cells.insert(line.cells.end(), cells.begin(), cells.end());
    }
    rule_next_ = any ? false : line.rule_above;
    if (any) table_.rows.push_back(std::move(line));
  }

  void add_baselines() {
    add("before calibration", {std::string(kNoAblation), std::string(kRaw)}, kRaw, false, false);
    add("bias removal", {std::string(kNoAblation), std::string(kBias)}, kBias, false, false);
    add("no ablation", RowId{}, kNoAblation, true, false);
  }

  void note(const std::string& text) { table_.note += " " + text; }
  Table take() { return std::move(table_); }

 private:
  PaperTable paper_;
  Table table_;
  std::vector<const ConditionResults*> conditions_;
  bool rule_next_ = false;  ///< a row with a rule above it was left out
};

/// Starts a part of a table with a rule: the paper's groups, its joints, what is beyond its rows.
bool starts_part(const FeatureSet& set) {
  return set.id == ablated_sets().front().id || set.id == joint_set(1) ||
         set.id == ablated_sets()[paper_sets().size()].id;
}

RowId tested_as(std::string id) { return {std::string(kNoAblation), std::move(id)}; }

Table removal_table(const Results& results) {
  TableBuilder builder("removal", "Removal of features: networks trained without", "without",
                       PaperTable::kRemoval, results);
  builder.add_baselines();
  for (const FeatureSet& set : ablated_sets()) {
    builder.add(set.title, {set.id, std::string(kNoAblation)}, set.id, starts_part(set), true);
  }
  return builder.take();
}

Table inaccurate_table(const Plan& plan, const Results& results, NoiseInto into) {
  const bool released = into == NoiseInto::kBelievedAsWell;
  TableBuilder builder(released ? "inaccurate_released" : "inaccurate",
                       fmt::format("Inaccurate features, {}: noise of ± one standard deviation at "
                                   "test",
                                   released ? "as the authors' code was released" : "inputs alone"),
                       "noise on", PaperTable::kInaccurate, results);
  builder.add_baselines();
  for (const FeatureSet& set : released ? paper_sets() : ablated_sets()) {
    const std::string test = released ? released_id(set.id) : variant_id(Noise::kDeviation, set.id);
    builder.add(set.title, tested_as(test), set.id, starts_part(set), true);
  }
  builder.note(
      fmt::format("The deviation is that of the {} rows.", name_of(plan.settings.noise_from)));
  if (released) builder.note(kReleasedNote);
  return builder.take();
}

Table noise_kinds_table(const Results& results) {
  TableBuilder builder("noise_kinds", "Other kinds of inaccuracy, at test only", "spoilt",
                       PaperTable::kInaccurate, results);
  builder.add("no ablation", RowId{}, "", false, false);
  for (const FeatureSet& set : grouped_sets()) {
    for (const Noise noise : kOtherNoises) {
      builder.add(fmt::format("{}, {}", set.title, title_of(noise)),
                  tested_as(variant_id(noise, set.id)), "", noise == kOtherNoises[0], true);
    }
  }
  return builder.take();
}

Table torque_table(const Results& results) {
  TableBuilder builder("torque", "Modified torque features, at test only", "changed",
                       PaperTable::kTorque, results);
  builder.add("none", RowId{}, kNoAblation, false, false);
  for (const FeatureSet& set : torque_sets()) {
    for (const Noise noise : kTorqueNoises) {
      builder.add(fmt::format("{}, {}", set.title, title_of(noise)),
                  tested_as(variant_id(noise, set.id)), set.id == kTorques ? name_of(noise) : "",
                  noise == kTorqueNoises[0], true);
    }
  }
  return builder.take();
}

struct HomingRow {
  std::string title;
  RowId row;
  std::string_view paper_row;
};

std::vector<HomingRow> homing_rows() {
  const std::string none(kNoAblation);
  const std::string inaccurate = variant_id(Noise::kDeviation, kNoEncoder);
  std::vector<HomingRow> rows = {{"all features", {std::string(kAllFeatures), none}, kAllFeatures}};
  for (const FeatureSet& set : homing_sets()) rows.push_back({set.title, {set.id, none}, set.id});
  rows.push_back(
      {"inaccurate encoder", {std::string(kAllFeatures), inaccurate}, kInaccurateEncoder});
  rows.push_back({"no other poses, only encoder", {std::string(kOnlyEncoder), none}, kOnlyEncoder});
  rows.push_back({"no other poses, inaccurate encoder",
                  {std::string(kOnlyEncoder), inaccurate},
                  kOnlyInaccurateEncoder});
  return rows;
}

/// Both data sets, all homings together: the paper's table.
Table homing_table(const Results& results) {
  Table table;
  table.id = "homing";
  table.title = "Modified pose features: tests after 0, 1, 2, ... homings together";
  table.row_title = "trained with";
  table.note = kMarkNote;
  table.note += " No ablation is here all features of the same training.";
  table.theirs_label = kTheirs;
  for (const ConditionResults& condition : results.conditions) {
    if (!condition.condition().homing) continue;
    if (table.columns.empty()) add_columns(table, condition.joints(), "");
    note_shared_seeds(condition, table);
    bool first = true;
    for (const HomingRow& line : homing_rows()) {
      if (!condition.has(line.row)) continue;
      table.rows.push_back({fmt::format("{}: {}", condition.condition().title, line.title),
                            cells_of(condition, line.row, homing_rows().front().row,
                                     PaperTable::kHoming, line.paper_row),
                            std::exchange(first, false) && !table.rows.empty()});
    }
  }
  return table;
}

/// One table per condition: joints as groups, homings as columns.
Table decay_table(const ConditionResults& results, std::size_t index) {
  Table table;
  table.id = fmt::format("homing_{}", index);
  table.title =
      fmt::format("Re-homing, {}: RMSE by homings since training", results.condition().title);
  table.row_title = "trained with";
  table.note =
      "Mean over seeds ± standard deviation over seeds, with its 95 % interval. Marked: more "
      "than 30 % above the same network before any homing.";
  note_shared_seeds(results, table);
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
        row.cells.push_back(cell_of(results, {line.row, i}, {joint, false}, Tested{line.row, 0}));
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
    add(inaccurate_table(plan, results, NoiseInto::kInputs));
    add(inaccurate_table(plan, results, NoiseInto::kBelievedAsWell));
    if (plan.study != kPaperStudy) add(noise_kinds_table(results));
  }
  if (includes(plan, "torque")) add(torque_table(results));
  add(homing_table(results));
  for (std::size_t i = 0; i < results.conditions.size(); ++i) {
    if (results.conditions[i].condition().homing) add(decay_table(results.conditions[i], i));
  }
  add(samples_table(results));
  return tables;
}

}  // namespace ravencal::study
