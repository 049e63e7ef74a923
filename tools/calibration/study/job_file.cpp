// SPDX-License-Identifier: Apache-2.0
//
// A job's result as JSON. Numbers are written with all their digits and read back exactly.
#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/whole_file.hpp"
#include "study/job.hpp"

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kJobSchema = 1;

Json json_of(const ErrorBlocks& blocks) {
  return {{"peak", blocks.peak},
          {"effective_samples", blocks.effective_samples},
          {"correlation_s", blocks.correlation_s},
          {"counts", blocks.counts},
          {"squares", blocks.squares}};
}

/// JSON has no infinity or NaN and the library reads them back as null: a network that overflowed.
double number_or_infinite(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}

ErrorBlocks blocks_from(const Json& json) {
  ErrorBlocks blocks;
  blocks.peak = number_or_infinite(json.at("peak"));
  blocks.effective_samples = number_or_infinite(json.at("effective_samples"));
  blocks.correlation_s = number_or_infinite(json.at("correlation_s"));
  blocks.counts = json.at("counts").get<std::vector<std::uint32_t>>();
  for (const Json& square : json.at("squares"))
    blocks.squares.push_back(number_or_infinite(square));
  if (blocks.counts.size() != blocks.squares.size()) {
    throw std::invalid_argument("counts and squares differ in length");
  }
  return blocks;
}

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
  Json json = {
      {"schema", kJobSchema}, {"job", result.description}, {"final_loss", result.final_loss},
      {"block_s", kBlockS},   {"joints", Json::array()},   {"rows", Json::array()},
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
  if (json.at("schema") != kJobSchema) throw std::invalid_argument("another version's result");
  result.description = json.at("job");
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

core::Status write_result(const JobResult& result, const std::filesystem::path& path) {
  // A requeued job may run while the earlier process still writes: each has a partial file of its
  // own.
  return core::write_whole_file(path, json_of(result).dump() + "\n");
}

core::Result<std::optional<JobResult>> read_result(const Plan& plan, const Job& job,
                                                   const std::filesystem::path& folder) {
  const std::filesystem::path path = result_path(folder, job);
  std::error_code missing;
  if (!std::filesystem::exists(path, missing)) return std::optional<JobResult>();
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  try {
    JobResult result = result_from(Json::parse(text));
    if (result.description != description_of(plan, job)) {
      throw std::invalid_argument("it is the result of another job");
    }
    return std::optional(std::move(result));
  } catch (const std::exception& error) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: is no result of this job: {}; remove it and run the job "
                                   "again",
                                   path.string(), error.what())};
  }
}

}  // namespace ravencal::study
