// SPDX-License-Identifier: Apache-2.0
//
// compare.json and what is made of the same tables; compare_page.js draws the page from the JSON.
#include <nlohmann/json.hpp>

#include "core/whole_file.hpp"
#include "report/document.hpp"
#include "study/compare.hpp"
#include "study/compare_tables.hpp"

extern "C" {
// Names of the assembler (ravencal_embed_script). NOLINTNEXTLINE(readability-identifier-naming)
extern const char ravencal_compare_page[], ravencal_compare_page_end[];
}

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

Json verdict_json(const RivalVerdict& v) {
  return {{"joint", v.joint},   {"unit", v.unit},
          {"ours", v.ours},     {"ours_rmse", v.ours_rmse},
          {"rival", v.rival},   {"rival_rmse", v.rival_rmse},
          {"ratio", v.ratio},   {"ratio_ci95", {v.ratio_low, v.ratio_high}},
          {"verdict", v.text()}};
}

Json map_json(const CompareGrid& map) {
  return {{"x", map.x.joint},
          {"x_unit", map.x.unit},
          {"x_edges", map.x.edges},
          {"y", map.y.joint},
          {"y_unit", map.y.unit},
          {"y_edges", map.y.edges},
          {"cells", map.x.edges.empty() ? 0 : map.x.edges.size() - 1}};
}

Json comparison_json(const Comparison& c, const std::vector<Table>& tables) {
  Json j = {{"schema", kCompareSchema},
            {"title", c.title},
            {"verdict", verdict_text(c)},
            {"order", c.order},
            {"training_minutes", c.training_minutes},
            {"loop_budget_us", c.loop_budget_us},
            {"facts", Json::object()},
            {"same_seed", learn::shared_seeds_json(c.shared.runs)},
            {"one_homing", learn::shared_seeds_json(c.shared.homings)},
            {"verdicts", Json::array()},
            {"tables", Json::array()},
            {"map", map_json(c.map)},
            {"methods", Json::array()}};
  for (const auto& [name, value] : c.facts) j["facts"][name] = value;
  for (const RivalVerdict& v : c.verdicts) j["verdicts"].push_back(verdict_json(v));
  for (const Table& table : tables) j["tables"].push_back(table_json(table));
  for (const MethodResult& m : c.methods) j["methods"].push_back(method_json(m, false));
  return j;
}

}  // namespace

core::Status write_comparison(const Comparison& c, const std::filesystem::path& folder) {
  const std::vector<Table> tables = comparison_tables(c);
  const Json json = comparison_json(c, tables);
  const auto text = [&](int indent) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
  };
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "compare.json", text(1)));
  RAVENCAL_RETURN_IF_ERROR(write_tables(tables, folder / "compare", verdict_text(c) + "\n\n"));
  return core::write_whole_file(
      folder / "compare.html",
      report::drawn_html(c.title.empty() ? "Comparison of methods" : c.title, text(-1),
                         "compare.json", {ravencal_compare_page, ravencal_compare_page_end}));
}

}  // namespace ravencal::study
