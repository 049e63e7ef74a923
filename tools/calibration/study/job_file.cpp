// SPDX-License-Identifier: Apache-2.0
//
// A job's result as JSON. Numbers are written with all their digits and read back exactly.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "study/job.hpp"
#include "study/job_store.hpp"

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const RowMap& map) {
  Json joints = Json::array();
  for (const std::vector<report::MapCell>& cells : map.joints) {
    Json samples = Json::array();
    Json rmse = Json::array();
    for (const report::MapCell& cell : cells) {
      samples.push_back(cell.samples);
      rmse.push_back(cell.samples > 0 ? cell.rmse : 0.0);
    }
    joints.push_back({{"samples", std::move(samples)}, {"rmse", std::move(rmse)}});
  }
  return {{"row", map.id}, {"joints", std::move(joints)}};
}

Json json_of(const JobResult& result) {
  Json json = {{"final_loss", result.final_loss},
               {"block_s", kBlockS},
               {"joints", Json::array()},
               {"rows", Json::array()},
               {"maps", Json::array()}};
  for (const JointName& joint : result.joints) {
    json["joints"].push_back({{"name", joint.name}, {"unit", joint.unit}});
  }
  for (const RowErrors& row : result.rows) {
    Json joints = Json::array();
    for (const auto& recordings : row.joints) {
      Json own = Json::array();
      for (const ErrorBlocks& blocks : recordings) own.push_back(json_of(blocks));
      joints.push_back(std::move(own));
    }
    json["rows"].push_back({{"row", row.id}, {"joints", std::move(joints)}});
  }
  if (result.grid) {
    const report::MapGrid& g = *result.grid;
    json["grid"] = {{"x", {g.x_from, g.x_to}},
                    {"y", {g.y_from, g.y_to}},
                    {"columns", g.columns},
                    {"rows", g.rows}};
  }
  for (const RowMap& map : result.maps) json["maps"].push_back(json_of(map));
  return json;
}

/// The items of a list that must have as many.
std::vector<JsonPlace> as_many(const JsonPlace& list, std::size_t count, const char* of_what) {
  std::vector<JsonPlace> items = list.items();
  if (items.size() != count) list.refuse(fmt::format("a list of {}: {}", count, of_what));
  return items;
}

report::MapGrid grid_from(const JsonPlace& json) {
  constexpr std::size_t kMostCells = 1000;  // of a side; a job has 14
  const auto x = as_many(json["x"], 2, "from, to");
  const auto y = as_many(json["y"], 2, "from, to");
  return {x[0].number(),
          x[1].number(),
          y[0].number(),
          y[1].number(),
          json["columns"].whole<std::size_t>(1, kMostCells),
          json["rows"].whole<std::size_t>(1, kMostCells)};
}

RowMap map_from(const JsonPlace& json, const JobResult& result) {
  if (!result.grid) json.refuse("there without 'grid'");
  const std::size_t cells = result.grid->columns * result.grid->rows;
  RowMap map{json["row"].text(), {}};
  for (const JsonPlace& joint : as_many(json["joints"], result.joints.size(), "one per joint")) {
    const auto samples = as_many(joint["samples"], cells, "one per cell of the grid");
    const auto rmse = as_many(joint["rmse"], cells, "one per cell of the grid");
    map.joints.emplace_back();
    for (std::size_t i = 0; i < cells; ++i) {
      map.joints.back().push_back({samples[i].whole<std::uint64_t>(), rmse[i].figure(), 0.0});
    }
  }
  return map;
}

/// The rows that a job may have: what nothing was trained for, and its network's tests.
std::set<std::string> rows_of(const Job& job) {
  std::set<std::string> rows;
  if (job.tests != TestSet::kPlain) rows = {std::string(kRaw), std::string(kBias)};
  for (const Variant& variant : variants_of(job.tests)) rows.insert(variant.id);
  return rows;
}

RowErrors row_from(const JsonPlace& json, std::size_t joints, std::size_t tests) {
  RowErrors row{json["row"].text(), {}};
  for (const JsonPlace& joint : as_many(json["joints"], joints, "one per joint")) {
    row.joints.emplace_back();
    for (const JsonPlace& blocks : as_many(joint, tests, "one per test recording")) {
      row.joints.back().push_back(blocks_from(blocks));
    }
  }
  return row;
}

/// Throws std::invalid_argument that names the key.
JobResult result_from(const JsonPlace& json, const Job& job, std::size_t tests) {
  JobResult result;
  result.final_loss = json["final_loss"].figure();
  if (json["block_s"].number() != kBlockS) json["block_s"].refuse(fmt::format("{}", kBlockS));
  for (const JsonPlace& joint : json["joints"].some()) {
    result.joints.push_back({joint["name"].text(), joint["unit"].text()});
  }
  std::set<std::string> open = rows_of(job);
  for (const JsonPlace& row : json["rows"].some()) {
    result.rows.push_back(row_from(row, result.joints.size(), tests));
    if (open.erase(result.rows.back().id) == 0) row["row"].refuse("a row of this job, once");
    if (shape_of(result.rows.back()) != shape_of(result.rows.front())) {
      row["joints"].refuse("blocks of the same times as those of the first row");
    }
  }
  if (open.contains(std::string(kNoAblation))) {
    json["rows"].refuse(fmt::format("a list with the row '{}'", kNoAblation));
  }
  if (json.has("grid")) {
    if (result.joints.size() < 2) json["grid"].refuse("there with one joint");
    result.grid = grid_from(json["grid"]);
  }
  for (const JsonPlace& map : json["maps"].items()) result.maps.push_back(map_from(map, result));
  return result;
}

}  // namespace

std::vector<std::size_t> shape_of(const RowErrors& row) {
  std::vector<std::size_t> blocks;
  for (const auto& recordings : row.joints) {
    for (const ErrorBlocks& one : recordings) blocks.push_back(one.counts.size());
  }
  return blocks;
}

core::Status write_result(const Plan& plan, const Job& job, const JobResult& result,
                          const std::filesystem::path& folder) {
  return keep_result(folder, description_of(plan, job), json_of(result));
}

core::Result<std::optional<JobResult>> read_result(const Plan& plan, const Job& job,
                                                   const std::filesystem::path& folder) {
  std::optional<JobResult> result;
  RAVENCAL_ASSIGN_OR_RETURN([[maybe_unused]] const bool there,
                            take_result(folder, description_of(plan, job), [&](const Json& json) {
                              const std::size_t tests = plan.conditions[job.condition].test.size();
                              result = result_from(JsonPlace(json), job, tests);
                            }));
  return result;
}

}  // namespace ravencal::study
