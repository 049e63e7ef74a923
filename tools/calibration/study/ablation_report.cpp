// SPDX-License-Identifier: Apache-2.0
#include "study/ablation_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "core/whole_file.hpp"
#include "learn/evaluate.hpp"
#include "report/charts.hpp"
#include "report/document.hpp"

extern "C" {
// Names of the assembler (ravencal_embed_script). NOLINTNEXTLINE(readability-identifier-naming)
extern const char ravencal_ablation_page[], ravencal_ablation_page_end[];
}

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

const RowMap* map_of(const ConditionResults& results, std::string_view id) {
  const auto found = std::find_if(results.maps.begin(), results.maps.end(),
                                  [&](const RowMap& map) { return map.id == id; });
  return found == results.maps.end() ? nullptr : &*found;
}

/// A figure that is not finite is written as null.
Json cells_json(const std::vector<report::MapCell>& cells, double per_si) {
  Json values = Json::array(), rows = Json::array();
  for (const report::MapCell& cell : cells) {
    values.push_back(cell.samples < report::kLeastCellSamples ? kUnknown : cell.rmse * per_si);
    rows.push_back(cell.samples);
  }
  return {{"values", std::move(values)}, {"rows", std::move(rows)}};
}

Json axis_json(const JointName& joint, double from, double to, std::size_t cells) {
  const core::DisplayUnit unit = core::display_unit(joint.unit);
  return {{"title", fmt::format("{} [{}]", joint.name, unit.name)},
          {"edges", report::edges_of(from * unit.per_si, to * unit.per_si, cells)}};
}

/// Raw, bias removed and calibrated over the workspace; null unless there are all three.
Json maps_json(const ConditionResults& results) {
  const RowMap* const raw = map_of(results, kRaw);
  const RowMap* const bias = map_of(results, kBias);
  const RowMap* const none = map_of(results, kNoAblation);
  if (!results.grid || raw == nullptr || bias == nullptr || none == nullptr) return nullptr;
  const report::MapGrid& grid = *results.grid;
  const auto& joints = results.joints();
  Json list = Json::array();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const core::DisplayUnit unit = core::display_unit(joints[i].unit);
    list.push_back({{"joint", joints[i].name},
                    {"unit", unit.name},
                    {"raw", cells_json(raw->joints[i], unit.per_si)},
                    {"bias", cells_json(bias->joints[i], unit.per_si)},
                    {"none", cells_json(none->joints[i], unit.per_si)}});
  }
  return {{"condition", results.condition().title},
          {"x", axis_json(joints[0], grid.x_from, grid.x_to, grid.columns)},
          {"y", axis_json(joints[1], grid.y_from, grid.y_to, grid.rows)},
          {"joints", std::move(list)}};
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
  for (const std::string& sentence : plan.left_out) facts.emplace_back("left out", sentence);
  return facts;
}

Json page_json(const Plan& plan, const Results& results, const std::vector<Table>& tables,
               const std::string& findings) {
  Json page = {{"study", plan.study},
               {"networks", plan.jobs.size()},
               {"missing", results.missing.size()},
               {"findings", Json::parse(findings)["findings"]},
               {"tables", Json::array()},
               {"maps", Json::array()},
               {"provenance", provenance_of(plan)}};
  for (const Table& table : tables) page["tables"].push_back(table_json(table));
  for (const ConditionResults& condition : results.conditions) {
    if (Json maps = maps_json(condition); !maps.is_null()) page["maps"].push_back(std::move(maps));
  }
  return page;
}

}  // namespace

core::Status write_ablation_report(const Plan& plan, const Results& results,
                                   const std::vector<Table>& tables,
                                   const std::vector<Finding>& findings,
                                   const std::filesystem::path& folder) {
  const std::string checked = findings_json(findings);
  RAVENCAL_RETURN_IF_ERROR(write_tables(tables, folder / "tables", ""));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "findings.json", checked));
  const std::string data = page_json(plan, results, tables, checked)
                               .dump(-1, ' ', false, Json::error_handler_t::replace);
  return core::write_whole_file(
      folder / "report.html",
      report::drawn_html("Feature ablation", data, "tables.csv, findings.json, plan.json and jobs",
                         {ravencal_ablation_page, ravencal_ablation_page_end}));
}

}  // namespace ravencal::study
