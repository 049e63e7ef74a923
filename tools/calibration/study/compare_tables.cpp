// SPDX-License-Identifier: Apache-2.0
#include "study/compare_tables.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace ravencal::study {
namespace {

const CompareJoint* joint_of(const MethodResult& m, std::size_t k) {
  return m.status == CompareStatus::kDone && k < m.joints.size() ? &m.joints[k] : nullptr;
}

const MethodResult* first_done(const Comparison& c) {
  for (const MethodResult& m : c.methods) {
    if (m.status == CompareStatus::kDone) return &m;
  }
  return nullptr;
}

std::string row_title(const MethodResult& m) { return m.ours ? m.title + " (ours)" : m.title; }

/// A row with its cells empty; a line sets ours off from theirs.
Row start_row(const Comparison& c, std::size_t index) {
  Row row;
  row.title = row_title(c.methods[index]);
  row.rule_above = index > 0 && c.methods[index].ours != c.methods[index - 1].ours;
  return row;
}

/// RMSE and perhaps peak of every joint in set `set`.
void add_set_columns(const Comparison& c, const std::string& set, bool peaks,
                     const std::string& prefix, Table& table) {
  for (const CompareJoint& joint : first_done(c)->joints) {
    table.columns.push_back(
        {peaks ? "RMSE" : joint.joint, joint.unit, peaks ? joint.joint : prefix, -1});
    if (peaks) table.columns.push_back({"peak", joint.unit, joint.joint, -1});
  }
  std::vector<double> least;
  for (std::size_t i = 0; i < c.methods.size(); ++i) {
    if (table.rows.size() <= i) table.rows.push_back(start_row(c, i));
    for (std::size_t k = 0; k < first_done(c)->joints.size(); ++k) {
      Cell rmse;
      Cell peak;
      const CompareJoint* joint = joint_of(c.methods[i], k);
      if (joint != nullptr && joint->sets.contains(set)) {
        const CompareFigure& f = joint->sets.at(set);
        rmse = {f.rmse, kUnknown, f.rmse_low, f.rmse_high, kUnknown, Mark::kNone, ""};
        peak = {f.peak, kUnknown, f.peak_low, f.peak_high, kUnknown, Mark::kNone, ""};
      } else if (k == 0 && joint == nullptr) {
        rmse.text = c.methods[i].status == CompareStatus::kUnsuited ? "unsuited" : "failed";
      }
      table.rows[i].cells.push_back(rmse);
      if (peaks) table.rows[i].cells.push_back(peak);
    }
  }
}

/// Marks the least figure of every column.
void mark_best(Table& table) {
  for (std::size_t column = 0; column < table.columns.size(); ++column) {
    Cell* best = nullptr;
    for (Row& row : table.rows) {
      Cell& cell = row.cells[column];
      if (std::isfinite(cell.mean) && (best == nullptr || cell.mean < best->mean)) best = &cell;
    }
    if (best != nullptr) best->mark = Mark::kBest;
  }
}

std::string reasons(const Comparison& c) {
  std::vector<std::string> lines;
  for (const MethodResult& m : c.methods) {
    if (m.status != CompareStatus::kDone)
      lines.push_back(fmt::format("{}: {}.", m.title, m.reason));
  }
  return fmt::format("{}", fmt::join(lines, " "));
}

Table errors_table(const Comparison& c) {
  Table table{"errors", "Error on the test recordings", "method", "", "", {}, {}};
  add_set_columns(c, "test", true, "", table);
  mark_best(table);
  table.note =
      "Bold: least of a column. Intervals: 95 %, block bootstrap over time; that of a peak cannot "
      "reach beyond what was seen. " +
      reasons(c);
  for (const std::string& sentence : learn::sentences_of(c.shared))
    table.note += (table.note.ends_with(' ') ? "" : " ") + sentence + ".";
  return table;
}

Table robustness_table(const Comparison& c, const std::vector<std::string>& sets) {
  Table table{"robustness", "RMSE where training never was", "method", "", "", {}, {}};
  for (const std::string& set : sets) {
    add_set_columns(c, set, false, set == "load" ? "under another load" : "after homing again",
                    table);
  }
  mark_best(table);
  return table;
}

Cell figure(double value) {
  Cell cell;
  cell.mean = value;
  return cell;
}

Cell words(std::string text) {
  Cell cell;
  cell.text = std::move(text);
  return cell;
}

Table cost_table(const Comparison& c) {
  Table table{"cost", "What a method costs", "method", "", "", {}, {}};
  table.columns = {{"training", "s", "", 2},    {"data needed", "min", "", 1},
                   {"parameters", "", "", 0},   {"step p50", "µs", "", 1},
                   {"step p99.9", "µs", "", 1}, {"1 kHz loop", "", "", -1}};
  for (std::size_t i = 0; i < c.methods.size(); ++i) {
    const MethodResult& m = c.methods[i];
    Row row = start_row(c, i);
    if (m.status == CompareStatus::kDone) {
      row.cells = {figure(m.training_s),
                   figure(m.minutes_needed()),
                   figure(static_cast<double>(m.parameters)),
                   figure(m.loop.step.p50_us),
                   figure(m.loop.step.p999_us),
                   words(loop_words(m, c.loop_budget_us))};
    } else {
      row.cells.resize(table.columns.size());
    }
    table.rows.push_back(std::move(row));
  }
  table.note = fmt::format(
      "Data needed: least part of the {:.1f} min of training recordings whose error is within 1.1 "
      "times that of all (geometric mean over joints; among the parts of the curve). Step: in the "
      "host's "
      "1 kHz loop where the last column says so, else the processor time of the method's own code "
      "by itself. Budget of the loop: {:.0f} µs.",
      c.training_minutes, c.loop_budget_us);
  return table;
}

Table curve_table(const Comparison& c) {
  Table table{"curve", "Error by length of training, over all joints", "method", "", "", {}, {}};
  const MethodResult* first = first_done(c);
  for (const CurvePoint& p : first->curve)
    table.columns.push_back({fmt::format("{:.1f} min", p.minutes), "% of raw", "", 1});
  double raw = kUnknown;
  for (const MethodResult& m : c.methods) {
    if (m.id == "raw" && !m.curve.empty()) raw = overall(m.curve.back().rmse);
  }
  for (std::size_t i = 0; i < c.methods.size(); ++i) {
    Row row = start_row(c, i);
    for (std::size_t p = 0; p < table.columns.size(); ++p) {
      const auto& curve = c.methods[i].curve;
      row.cells.push_back(p < curve.size() ? figure(100.0 * overall(curve[p].rmse) / raw) : Cell{});
    }
    table.rows.push_back(std::move(row));
  }
  mark_best(table);
  table.note = "Geometric mean over joints of the test RMSE, as a share of the raw error's.";
  return table;
}

Table verdict_table(const Comparison& c) {
  Table table{"verdict", "The best of ours against the best of the others", "joint", "", "", {},
              {}};
  table.columns = {{"ours", "", "", -1},      {"RMSE", "", "ours", -1}, {"rival", "", "", -1},
                   {"RMSE", "", "rival", -1}, {"ratio", "", "", 3},     {"verdict", "", "", -1}};
  for (const RivalVerdict& v : c.verdicts) {
    Row row;
    row.title = v.joint + " [" + v.unit + "]";
    Cell ratio = figure(v.ratio);
    ratio.low = v.ratio_low;
    ratio.high = v.ratio_high;
    row.cells = {words(v.ours), figure(v.ours_rmse), words(v.rival), figure(v.rival_rmse),
                 ratio,         words(v.text())};
    table.rows.push_back(std::move(row));
  }
  table.note =
      "Ratio of RMSE with its 95 % interval from the same resampled blocks for both. The best of "
      "several is named after looking at the test, on both sides.";
  return table;
}

}  // namespace

std::string loop_words(const MethodResult& m, double budget_us) {
  if (m.id == "raw" || m.id == "bias") return m.id == "raw" ? "as it is" : "an addition";
  const LoopFitness& loop = m.loop;
  const std::string fits = loop.step.p999_us <= budget_us ? "fits" : "too slow";
  if (loop.measured)
    return fits + (loop.real_time ? ", in the loop" : ", in the loop (not real time)");
  return fits + (loop.loadable ? " by itself" : " by itself; cannot be loaded");
}

std::string verdict_text(const Comparison& c) {
  std::vector<std::string> better, equal, worse;
  for (const RivalVerdict& v : c.verdicts) {
    const std::string words = fmt::format("{} ({} {:.3g} {}, {} {:.3g})", v.joint, v.ours,
                                          v.ours_rmse, v.unit, v.rival, v.rival_rmse);
    (v.text() == "better" ? better : v.text() == "worse" ? worse : equal).push_back(words);
  }
  std::string text;
  if (!better.empty())
    text += fmt::format("Ours beats every rival at {}. ", fmt::join(better, ", "));
  if (!equal.empty())
    text += fmt::format("Not told apart from the best rival: {}. ", fmt::join(equal, ", "));
  if (!worse.empty()) text += fmt::format("A rival is better at {}. ", fmt::join(worse, ", "));
  if (text.empty()) return "Too few methods are done to compare.";
  text.pop_back();
  return text;
}

std::vector<Table> comparison_tables(const Comparison& c) {
  const MethodResult* first = first_done(c);
  if (first == nullptr) return {};
  std::vector<Table> tables = {errors_table(c)};
  std::vector<std::string> sets;
  for (const auto& [name, figure] : first->joints.front().sets) {
    if (name != "test") sets.push_back(name);
  }
  if (!sets.empty()) tables.push_back(robustness_table(c, sets));
  tables.push_back(cost_table(c));
  if (first->curve.size() > 1) tables.push_back(curve_table(c));
  if (!c.verdicts.empty()) tables.push_back(verdict_table(c));
  return tables;
}

}  // namespace ravencal::study
