// SPDX-License-Identifier: Apache-2.0
//
// plan.json: what a job on another machine has to know.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/json_text.hpp"
#include "core/whole_file.hpp"
#include "learn/network_limits.hpp"
#include "study/json_place.hpp"
#include "study/plan.hpp"

namespace ravencal::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kPlanSchema = 3;

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

template <typename T>
T known(const std::optional<T>& value, const JsonPlace& place, const char* expected) {
  if (!value) place.refuse(expected);
  return *value;
}

Settings settings_from(const JsonPlace& json) {
  Settings s;
  s.features = json["features"].text();
  s.homing_features = json["homing_features"].text();
  s.hidden.clear();
  for (const JsonPlace& width : json["hidden"].some()) {
    s.hidden.push_back(width.whole(1U, learn::kWidestLayer));
  }
  s.epochs = json["epochs"].whole(1U, learn::kMostEpochs);
  s.batch = json["batch"].whole(1U, learn::kLargestBatch);
  s.seeds = json["seeds"].whole(1U, kMostSeeds);
  s.first_seed = json["first_seed"].whole<std::uint64_t>();
  const JsonPlace isa = json["kernels"];
  s.isa = known(learn::isa_from(isa.text()), isa, "an instruction set");
  const JsonPlace noise = json["noise_from"];
  s.noise_from = known(noise_from_name(noise.text()), noise, "test or training");
  return s;
}

Json json_of(const std::optional<double>& time_s) { return time_s ? Json(*time_s) : Json(); }

std::optional<double> time_from(const JsonPlace& load, const char* key) {
  if (!load.has(key) || load[key].is_null()) return std::nullopt;
  return load[key].number();
}

std::vector<std::string> texts(const std::vector<JsonPlace>& places) {
  std::vector<std::string> list;
  for (const JsonPlace& place : places) list.push_back(place.text());
  return list;
}

std::vector<learn::SharedSeed> shared_from(const JsonPlace& list) {
  std::vector<learn::SharedSeed> shared;
  for (const JsonPlace& one : list.items()) {
    shared.push_back(
        {one["tested"].text(), one["trained"].text(), one["seed"].whole<std::uint64_t>()});
  }
  return shared;
}

std::optional<TestSet> tests_named(const std::string& name) {
  for (const TestSet set : {TestSet::kPlain, TestSet::kPaper, TestSet::kFull, TestSet::kEncoder}) {
    if (name_of(set) == name) return set;
  }
  return std::nullopt;
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
                                  {"test", condition.test},
                                  {"same_seed", shared_seeds_json(condition.shared.runs)},
                                  {"one_homing", shared_seeds_json(condition.shared.homings)}});
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

Condition condition_from(const JsonPlace& json) {
  Condition condition;
  condition.title = json["title"].text();
  condition.train = texts(json["train"].some());
  condition.test = texts(json["test"].some());
  condition.homing = json["homing"].flag();
  condition.rehomed = json["rehomed"].flag();
  condition.shared = {shared_from(json["same_seed"]), shared_from(json["one_homing"])};
  return condition;
}

Job job_from(const JsonPlace& json, std::size_t conditions) {
  Job job;
  job.condition = json["condition"].whole<std::size_t>(0, conditions - 1);
  job.row = json["row"].text();
  job.features = json["features"].text();
  job.seed = json["seed"].whole<std::uint64_t>();
  const JsonPlace tests = json["tests"];
  job.tests = known(tests_named(tests.text()), tests, "a set of tests");
  job.width = json["width"].whole(1U);
  job.key = json["key"].text();
  return job;
}

/// Throws std::invalid_argument that names the key.
Plan plan_from(const JsonPlace& json) {
  Plan plan;
  if (json["schema"].whole(0U) != kPlanSchema) {
    json["schema"].refuse(fmt::format("{}: another version's plan", kPlanSchema));
  }
  const JsonPlace study = json["study"];
  plan.study = study.text();
  if (std::find(std::begin(kStudies), std::end(kStudies), plan.study) == std::end(kStudies)) {
    study.refuse(fmt::format("one of {}", fmt::join(kStudies, ", ")));
  }
  plan.settings = settings_from(json["settings"]);
  const JsonPlace load = json["load"];
  plan.load.profile = load["profile"].text();
  plan.load.profile_options.arm = load["arm"].text();
  plan.load.skip_bad = load["skip_bad"].flag();
  plan.load.range = {time_from(load, "from_s"), time_from(load, "to_s")};
  for (const JsonPlace& condition : json["conditions"].some()) {
    plan.conditions.push_back(condition_from(condition));
  }
  for (const JsonPlace& input : json["inputs"].some()) {
    plan.inputs.push_back(
        {input["path"].text(), input["sha256"].text(), input["rows"].whole<std::uint64_t>()});
  }
  for (const JsonPlace& job : json["jobs"].some()) {
    plan.jobs.push_back(job_from(job, plan.conditions.size()));
  }
  plan.left_out = texts(json["left_out"].items());
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
  const auto refused = [&](const std::string& why) {
    return core::data_error(
        fmt::format("{}: is no plan of an ablation: {}; write it again with --plan",
                    plan_path(folder).string(), why));
  };
  const auto json = core::parse_json<Json>(text);
  if (!json.ok()) return refused(json.error().message);
  try {
    return plan_from(JsonPlace(*json));
  } catch (const std::exception& error) {
    return refused(error.what());
  }
}

}  // namespace ravencal::study
