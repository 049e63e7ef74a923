// SPDX-License-Identifier: Apache-2.0
//
// A job's result as JSON. Numbers are written with all their digits and read back exactly.
#include <nlohmann/json.hpp>

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

RowMap map_from(const Json& json) {
  RowMap map{json.at("row"), {}};
  for (const Json& joint : json.at("joints")) {
    map.joints.emplace_back();
    for (std::size_t i = 0; i < joint.at("samples").size(); ++i) {
      map.joints.back().push_back(
          {joint.at("samples").at(i), number_or_infinite(joint.at("rmse").at(i)), 0.0});
    }
  }
  return map;
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

JobResult result_from(const Json& json) {
  JobResult result;
  result.final_loss = number_or_infinite(json.at("final_loss"));
  for (const Json& joint : json.at("joints")) {
    result.joints.push_back({joint.at("name"), joint.at("unit")});
  }
  for (const Json& row : json.at("rows")) {
    RowErrors errors{row.at("row"), {}};
    for (const Json& joint : row.at("joints")) {
      errors.joints.emplace_back();
      for (const Json& blocks : joint) errors.joints.back().push_back(blocks_from(blocks));
    }
    result.rows.push_back(std::move(errors));
  }
  if (json.contains("grid")) {
    const Json& g = json.at("grid");
    result.grid = report::MapGrid{g.at("x").at(0), g.at("x").at(1), g.at("y").at(0),
                                  g.at("y").at(1), g.at("columns"), g.at("rows")};
  }
  for (const Json& map : json.at("maps")) result.maps.push_back(map_from(map));
  return result;
}

}  // namespace

core::Status write_result(const Plan& plan, const Job& job, const JobResult& result,
                          const std::filesystem::path& folder) {
  return keep_result(folder, description_of(plan, job), json_of(result));
}

core::Result<std::optional<JobResult>> read_result(const Plan& plan, const Job& job,
                                                   const std::filesystem::path& folder) {
  std::optional<JobResult> result;
  RAVENCAL_ASSIGN_OR_RETURN(
      [[maybe_unused]] const bool there,
      take_result(folder, description_of(plan, job),
                  [&result](const Json& json) { result = result_from(json); }));
  return result;
}

}  // namespace ravencal::study
