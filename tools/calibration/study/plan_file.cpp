// SPDX-License-Identifier: Apache-2.0
//
// plan.json: what a job on another machine has to know.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/whole_file.hpp"
#include "study/plan.hpp"

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kPlanSchema = 2;

Json settings_json(const Settings& s) {
  return {{"features", s.features},
          {"homing_features", s.homing_features},
          {"hidden", s.hidden},
          {"epochs", s.epochs},
          {"batch", s.batch},
          {"seeds", s.seeds},
          {"first_seed", s.first_seed},
          {"kernels", learn::name_of(s.isa)},
          {"noise_from", name_of(s.noise_from)}};
}

/// Throws nlohmann's exceptions for what is missing or of another type.
Settings settings_from(const Json& json) {
  Settings s;
  s.features = json.at("features");
  s.homing_features = json.at("homing_features");
  s.hidden = json.at("hidden").get<std::vector<std::uint32_t>>();
  s.epochs = json.at("epochs");
  s.batch = json.at("batch");
  s.seeds = json.at("seeds");
  s.first_seed = json.at("first_seed");
  const auto isa = learn::isa_from(json.at("kernels").get<std::string>());
  if (!isa) throw std::invalid_argument("'kernels' is no instruction set");
  s.isa = *isa;
  const auto noise_from = noise_from_name(json.at("noise_from").get<std::string>());
  if (!noise_from) throw std::invalid_argument("'noise_from' is neither test nor training");
  s.noise_from = *noise_from;
  return s;
}

Json json_of(const std::optional<double>& time_s) { return time_s ? Json(*time_s) : Json(); }

std::optional<double> time_from(const Json& load, const char* key) {
  const Json time_s = load.value(key, Json());
  return time_s.is_null() ? std::nullopt : std::optional(time_s.get<double>());
}

TestSet tests_from(const std::string& name) {
  for (const TestSet set : {TestSet::kPlain, TestSet::kPaper, TestSet::kFull, TestSet::kEncoder}) {
    if (name_of(set) == name) return set;
  }
  throw std::invalid_argument(fmt::format("'{}' is no set of tests", name));
}

Json json_of(const Plan& plan) {
  Json json = {{"schema", kPlanSchema},
               {"study", plan.study},
               {"settings", settings_json(plan.settings)},
               {"load",
                {{"profile", plan.load.profile},
                 {"arm", plan.load.profile_options.arm},
                 {"skip_bad", plan.load.skip_bad},
                 {"from_s", json_of(plan.load.range.from_s)},
                 {"to_s", json_of(plan.load.range.to_s)}}},
               {"conditions", Json::array()},
               {"inputs", Json::array()},
               {"jobs", Json::array()},
               {"left_out", plan.left_out}};
  for (const Condition& condition : plan.conditions) {
    json["conditions"].push_back({{"title", condition.title},
                                  {"homing", condition.homing},
                                  {"rehomed", condition.rehomed},
                                  {"train", condition.train},
                                  {"test", condition.test}});
  }
  for (const Input& input : plan.inputs) {
    json["inputs"].push_back(
        {{"path", input.path}, {"sha256", input.sha256}, {"rows", input.rows}});
  }
  for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
    const Job& job = plan.jobs[i];
    json["jobs"].push_back({{"job", i},
                            {"condition", job.condition},
                            {"row", job.row},
                            {"seed", job.seed},
                            {"tests", name_of(job.tests)},
                            {"width", job.width},
                            {"features", job.features},
                            {"key", job.key}});
  }
  return json;
}

Plan plan_from(const Json& json) {
  Plan plan;
  if (json.at("schema") != kPlanSchema) throw std::invalid_argument("another version's plan");
  plan.study = json.at("study");
  plan.settings = settings_from(json.at("settings"));
  plan.load.profile = json.at("load").at("profile");
  plan.load.profile_options.arm = json.at("load").at("arm");
  plan.load.skip_bad = json.at("load").at("skip_bad");
  plan.load.range = {time_from(json.at("load"), "from_s"), time_from(json.at("load"), "to_s")};
  for (const Json& c : json.at("conditions")) {
    plan.conditions.push_back({c.at("title"), c.at("train").get<std::vector<std::string>>(),
                               c.at("test").get<std::vector<std::string>>(), c.at("homing"),
                               c.at("rehomed")});
  }
  for (const Json& i : json.at("inputs"))
    plan.inputs.push_back({i.at("path"), i.at("sha256"), i.at("rows")});
  for (const Json& j : json.at("jobs")) {
    Job job;
    job.condition = j.at("condition");
    job.row = j.at("row");
    job.features = j.at("features");
    job.seed = j.at("seed");
    job.tests = tests_from(j.at("tests"));
    job.width = j.at("width");
    job.key = j.at("key");
    if (job.condition >= plan.conditions.size()) {
      throw std::invalid_argument(fmt::format("job {} is of no condition", plan.jobs.size()));
    }
    plan.jobs.push_back(std::move(job));
  }
  plan.left_out = json.at("left_out").get<std::vector<std::string>>();
  return plan;
}

}  // namespace

std::filesystem::path plan_path(const std::filesystem::path& folder) {
  return folder / "plan.json";
}

core::Status write_plan(const Plan& plan, const std::filesystem::path& folder) {
  return core::write_whole_file(plan_path(folder), json_of(plan).dump(1) + "\n");
}

core::Result<Plan> read_plan(const std::filesystem::path& folder) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(plan_path(folder)));
  try {
    return plan_from(Json::parse(text));
  } catch (const std::exception& error) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: is no plan of an ablation: {}; write it again with --plan",
                                   plan_path(folder).string(), error.what())};
  }
}

}  // namespace ravencal::study
