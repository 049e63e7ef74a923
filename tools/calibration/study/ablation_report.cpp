// SPDX-License-Identifier: Apache-2.0
#include "study/ablation_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/units.hpp"
#include "core/whole_file.hpp"
#include "learn/evaluate.hpp"
#include "report/escape.hpp"
#include "report/study_charts.hpp"
#include "report/study_page.hpp"
#include "study/ablation_tables.hpp"

namespace ravencal::study {
namespace {

Table findings_table(const std::vector<Finding>& findings) {
  Table table;
  table.id = "findings";
  table.title = "The paper's findings, checked";
  table.row_title = "finding";
  table.note =
      "A finding holds where the 95 % interval says so, and is undecided where the interval "
      "contains both; changes are of the mean over joints of RMSE ratios. Twin or your recordings, "
      "not the authors' robot.";
  table.columns = {{"condition", "", "", -1}, {"verdict", "", "", -1}};
  for (const Finding& finding : findings) {
    Cell condition;
    condition.text = finding.condition;
    Cell verdict;
    verdict.text = name_of(finding.verdict);
    if (finding.verdict == Verdict::kDoesNotHold) verdict.mark = Mark::kWorse;
    if (finding.verdict == Verdict::kHolds) verdict.mark = Mark::kBest;
    table.rows.push_back({finding.statement, {condition, verdict}, false});
  }
  return table;
}

/// Evidence is too long for a table's cell.
std::string evidence_html(const std::vector<Finding>& findings) {
  std::string html = "<ul>\n";
  for (const Finding& finding : findings) {
    if (finding.evidence.empty()) continue;
    html +=
        fmt::format("<li class=\"note\"><b>{} ({}): {}.</b> {}.</li>\n",
                    report::html_escape(finding.statement), report::html_escape(finding.condition),
                    name_of(finding.verdict), report::html_escape(finding.evidence));
  }
  return html + "</ul>\n";
}

/// Row whose figures the chart's reference lines show.
std::size_t reference_row(const Table& table) {
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (table.rows[i].title == "no ablation" || table.rows[i].title == "none") return i;
  }
  return 0;
}

/// One bar chart per column group.
std::vector<report::StudyFigure> bars_of(const Table& table) {
  std::vector<std::string> labels;
  for (const Row& row : table.rows) labels.push_back(row.title);
  const std::size_t reference = reference_row(table);
  std::vector<std::pair<std::string, std::vector<report::BarPanel>>> charts;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const Column& column = table.columns[i];
    report::BarPanel panel{column.title, column.unit, table.rows[reference].cells[i].mean, {}};
    for (const Row& row : table.rows) {
      const Cell& cell = row.cells[i];
      panel.bars.push_back({cell.mean, cell.low, cell.high, cell.mark == Mark::kWorse});
    }
    if (charts.empty() || charts.back().first != column.group)
      charts.emplace_back(column.group, std::vector<report::BarPanel>());
    charts.back().second.push_back(std::move(panel));
  }
  std::vector<report::StudyFigure> figures;
  for (const auto& [group, panels] : charts) {
    figures.push_back(
        {group,
         "Bars: mean RMSE over seeds; lines: 95 % interval; dashed: no ablation; the other colour: "
         "more than 30 % above it. Bars longer than six times the dashed line are cut.",
         report::bar_chart(table.title + ", " + group, labels, panels)});
  }
  return figures;
}

report::StudyFigure homing_figure(const Table& table, const ConditionResults& results) {
  const std::size_t tests = results.condition().test.size();
  std::vector<report::SettingPanel> panels;
  for (std::size_t joint = 0; joint < results.joints().size(); ++joint) {
    report::SettingPanel panel;
    panel.title = results.joints()[joint].name;
    panel.unit = core::display_unit(results.joints()[joint].unit).name;
    for (const Row& row : table.rows) {
      report::SettingLine line{row.title, {}, {}, {}};
      for (std::size_t i = 0; i < tests; ++i) {
        const Cell& cell = row.cells[joint * tests + i];
        line.values.push_back(cell.mean);
        line.low.push_back(cell.low);
        line.high.push_back(cell.high);
      }
      panel.lines.push_back(std::move(line));
    }
    panels.push_back(std::move(panel));
  }
  return {table.title,
          "Each point is a test recording after so many homings since training; vertical lines: 95 "
          "% interval. Logarithmic.",
          report::setting_chart(table.title, "homings since training", panels)};
}

const RowMap* map_of(const ConditionResults& results, std::string_view id) {
  const auto found = std::find_if(results.maps.begin(), results.maps.end(),
                                  [&](const RowMap& map) { return map.id == id; });
  return found == results.maps.end() ? nullptr : &*found;
}

/// Raw, bias removed and calibrated over the workspace, one figure per joint.
std::vector<report::StudyFigure> maps_of(const ConditionResults& results) {
  std::vector<report::StudyFigure> figures;
  const RowMap* const raw = map_of(results, kRaw);
  const RowMap* const bias = map_of(results, kBias);
  const RowMap* const none = map_of(results, kNoAblation);
  if (!results.grid || raw == nullptr || bias == nullptr || none == nullptr) return figures;
  const auto& joints = results.joints();
  const core::DisplayUnit x = core::display_unit(joints[0].unit);
  const core::DisplayUnit y = core::display_unit(joints[1].unit);
  report::MapGrid grid = *results.grid;
  grid.x_from *= x.per_si;
  grid.x_to *= x.per_si;
  grid.y_from *= y.per_si;
  grid.y_to *= y.per_si;
  for (std::size_t joint = 0; joint < joints.size(); ++joint) {
    const core::DisplayUnit unit = core::display_unit(joints[joint].unit);
    const auto shown = [&](const RowMap& map) {
      std::vector<report::MapCell> cells = map.joints[joint];
      for (report::MapCell& cell : cells) cell.rmse *= unit.per_si;
      return cells;
    };
    figures.push_back(
        {fmt::format("{}, {}", results.condition().title, joints[joint].name),
         "RMS error by place, both directions of motion. Raw has colours of its own. Hatched: "
         "untested.",
         report::workspace_chart(joints[joint].name, grid,
                                 fmt::format("{} [{}]", joints[0].name, x.name),
                                 fmt::format("{} [{}]", joints[1].name, y.name), unit.name,
                                 {{"before calibration", 0, shown(*raw)},
                                  {"bias removed", 1, shown(*bias)},
                                  {"calibrated, first seed", 1, shown(*none)}})});
  }
  return figures;
}

std::vector<std::pair<std::string, std::string>> provenance_of(const Plan& plan) {
  const Settings& s = plan.settings;
  std::vector<std::pair<std::string, std::string>> facts = {
      {"study", plan.study},
      {"networks", fmt::format("{}, {} seeds from {} on, in steps of 10", plan.jobs.size(), s.seeds,
                               s.first_seed)},
      {"hidden layers", fmt::format("{}", fmt::join(s.hidden, ", "))},
      {"epochs", fmt::format("{}, batch {}; the last epoch's weights", s.epochs, s.batch)},
      {"features", s.features.empty() ? "(every channel)" : s.features},
      {"kernels", std::string(learn::name_of(s.isa))}};
  if (!s.homing_features.empty()) facts.emplace_back("features, re-homing", s.homing_features);
  for (const Input& input : plan.inputs) {
    facts.emplace_back(std::filesystem::path(input.path).filename().string(),
                       fmt::format("{} rows, sha256 {}", input.rows, input.sha256));
  }
  return facts;
}

std::string verdict_of(const std::vector<Finding>& findings) {
  const auto count = [&](Verdict verdict) {
    return std::count_if(findings.begin(), findings.end(),
                         [&](const Finding& finding) { return finding.verdict == verdict; });
  };
  return fmt::format("{} of the paper's findings hold, {} do not, {} are undecided, {} not tested.",
                     count(Verdict::kHolds), count(Verdict::kDoesNotHold),
                     count(Verdict::kUndecided), count(Verdict::kNotTested));
}

/// As the page's list of contents shows it.
std::string heading_of(const Table& table, const ConditionResults* homing) {
  if (homing != nullptr) return "Re-homing, " + homing->condition().title;
  constexpr std::pair<std::string_view, const char*> kHeadings[] = {
      {"removal", "Removal"},
      {"inaccurate", "Inaccurate features"},
      {"noise_kinds", "Other inaccuracies"},
      {"torque", "Torque"},
      {"samples", "Samples"}};
  for (const auto& [id, heading] : kHeadings) {
    if (table.id == id) return heading;
  }
  return table.title;
}

const ConditionResults* homing_condition(const Results& results, const std::string& table_id) {
  for (std::size_t i = 0; i < results.conditions.size(); ++i) {
    if (table_id == fmt::format("homing_{}", i)) return &results.conditions[i];
  }
  return nullptr;
}

report::StudyPage page_of(const Plan& plan, const Results& results,
                          const std::vector<Table>& tables, const std::vector<Finding>& findings) {
  report::StudyPage page;
  page.title = "Feature ablation";
  page.subtitle = fmt::format("{}: {} networks", plan.study, plan.jobs.size());
  if (!results.missing.empty()) {
    page.subtitle += fmt::format("; INCOMPLETE, {} are missing", results.missing.size());
  }
  page.verdict = verdict_of(findings);
  if (!findings.empty()) {
    page.sections.push_back(
        {"findings", "Findings", to_html(findings_table(findings)) + evidence_html(findings), {}});
  }
  for (const Table& table : tables) {
    const ConditionResults* const homing = homing_condition(results, table.id);
    report::StudySection section{table.id, heading_of(table, homing), to_html(table), {}};
    if (homing != nullptr) {
      section.figures.push_back(homing_figure(table, *homing));
    } else if (table.id != "samples") {
      section.figures = bars_of(table);
    }
    page.sections.push_back(std::move(section));
  }
  report::StudySection maps{"maps", "Errors over the workspace", "", {}};
  for (const ConditionResults& condition : results.conditions) {
    for (report::StudyFigure& figure : maps_of(condition)) {
      maps.figures.push_back(std::move(figure));
    }
  }
  if (!maps.figures.empty()) page.sections.push_back(std::move(maps));
  page.provenance = provenance_of(plan);
  for (const std::string& sentence : plan.left_out)
    page.provenance.emplace_back("left out", sentence);
  return page;
}

}  // namespace

core::Status write_ablation_report(const Plan& plan, const Results& results,
                                   const std::vector<Finding>& findings,
                                   const std::filesystem::path& folder) {
  const std::vector<Table> tables = ablation_tables(plan, results);
  std::string markdown;
  std::string latex;
  for (const Table& table : tables) {
    markdown += to_markdown(table) + "\n";
    latex += to_latex(table) + "\n";
  }
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "tables.csv", to_csv(tables)));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "tables.md", markdown));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "tables.tex", latex));
  RAVENCAL_RETURN_IF_ERROR(
      core::write_whole_file(folder / "findings.json", findings_json(findings)));
  return report::write_study_html(page_of(plan, results, tables, findings), folder / "report.html");
}

}  // namespace ravencal::study
