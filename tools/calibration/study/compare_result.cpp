// SPDX-License-Identifier: Apache-2.0
#include "study/compare_result.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/whole_file.hpp"
#include "study/job_store.hpp"

namespace ravencal::study {
namespace {

using json = nlohmann::ordered_json;

constexpr double kUnknownFigure = std::numeric_limits<double>::quiet_NaN();

/// JSON has no NaN; null is written for it.
double number_of(const json& value) {
  return value.is_number() ? value.get<double>() : kUnknownFigure;
}

std::vector<double> numbers_of(const json& list) {
  std::vector<double> values;
  for (const json& value : list) values.push_back(number_of(value));
  return values;
}

json to_json(const StepTime& s) {
  return {{"p50_us", s.p50_us}, {"p99_us", s.p99_us}, {"p999_us", s.p999_us}};
}
StepTime step_of(const json& j) {
  return {number_of(j.at("p50_us")), number_of(j.at("p99_us")), number_of(j.at("p999_us"))};
}

json to_json(const CompareFigure& f) {
  return {{"rmse", f.rmse},       {"rmse_ci95", {f.rmse_low, f.rmse_high}},
          {"peak", f.peak},       {"peak_ci95", {f.peak_low, f.peak_high}},
          {"samples", f.samples}, {"effective_samples", f.effective_samples}};
}
CompareFigure figure_of(const json& j) {
  return {number_of(j.at("rmse")),
          number_of(j.at("rmse_ci95").at(0)),
          number_of(j.at("rmse_ci95").at(1)),
          number_of(j.at("peak")),
          number_of(j.at("peak_ci95").at(0)),
          number_of(j.at("peak_ci95").at(1)),
          number_of(j.at("samples")),
          number_of(j.at("effective_samples"))};
}

json to_json(const CompareJoint& joint, bool with_blocks) {
  json j = {{"joint", joint.joint}, {"unit", joint.unit}, {"sets", json::object()}};
  for (const auto& [name, figure] : joint.sets) j["sets"][name] = to_json(figure);
  if (!with_blocks) return j;
  j["blocks"] = json::array();
  for (const ErrorBlocks& blocks : joint.blocks) j["blocks"].push_back(json_of(blocks));
  return j;
}
CompareJoint joint_of(const json& j) {
  CompareJoint joint;
  joint.joint = j.at("joint");
  joint.unit = j.at("unit");
  for (const auto& [name, figure] : j.at("sets").items()) joint.sets[name] = figure_of(figure);
  if (!j.contains("blocks")) return joint;
  for (const json& blocks : j["blocks"])
    joint.blocks.push_back(blocks_from(JsonPlace(blocks, "blocks")));
  return joint;
}

std::string_view word(CompareStatus status) {
  switch (status) {
    case CompareStatus::kDone:
      return "done";
    case CompareStatus::kUnsuited:
      return "unsuited";
    case CompareStatus::kFailed:
      return "failed";
  }
  return "";
}

MethodResult method_of(const json& j) {
  MethodResult m;
  m.id = j.at("id");
  m.title = j.at("title");
  m.source = j.at("source");
  m.ours = j.at("ours");
  const std::string status = j.at("status");
  m.status = status == "done"       ? CompareStatus::kDone
             : status == "unsuited" ? CompareStatus::kUnsuited
                                    : CompareStatus::kFailed;
  m.reason = j.at("reason");
  m.remark = j.at("remark");
  m.training_s = j.at("training_s");
  m.parameters = j.at("parameters");
  m.model_file = j.at("model");
  m.own_step = step_of(j.at("own_step"));
  const json& loop = j.at("loop");
  m.loop = {loop.at("loadable"),         loop.at("why_not"),   loop.at("measured"),
            loop.at("why_not_measured"), loop.at("real_time"), step_of(loop.at("step"))};
  for (const json& joint : j.at("joints")) m.joints.push_back(joint_of(joint));
  for (const json& p : j.at("curve"))
    m.curve.push_back({p.at("share"), p.at("minutes"), numbers_of(p.at("rmse"))});
  for (const json& map : j.at("maps"))
    m.maps.push_back({map.at("joint"), map.at("unit"), numbers_of(map.at("rmse"))});
  return m;
}

}  // namespace

double overall(const std::vector<double>& rmse) {
  if (rmse.empty()) return kUnknownFigure;
  double logs = 0.0;
  for (const double value : rmse) logs += std::log(std::max(value, 1e-300));
  return std::exp(logs / static_cast<double>(rmse.size()));
}

double MethodResult::minutes_needed() const {
  if (curve.size() < 2) return kUnknownFigure;
  const double limit = 1.1 * overall(curve.back().rmse);
  for (const CurvePoint& point : curve) {
    if (overall(point.rmse) <= limit) return point.minutes;
  }
  return curve.back().minutes;
}

std::string RivalVerdict::text() const {
  if (ratio_high < 1.0) return "better";
  return ratio_low > 1.0 ? "worse" : "not told apart";
}

nlohmann::ordered_json method_json(const MethodResult& m, bool with_blocks) {
  json j = {{"id", m.id},           {"title", m.title},           {"source", m.source},
            {"ours", m.ours},       {"status", word(m.status)},   {"reason", m.reason},
            {"remark", m.remark},   {"training_s", m.training_s}, {"parameters", m.parameters},
            {"model", m.model_file}};
  j["own_step"] = to_json(m.own_step);
  j["loop"] = {{"loadable", m.loop.loadable},   {"why_not", m.loop.why_not},
               {"measured", m.loop.measured},   {"why_not_measured", m.loop.why_not_measured},
               {"real_time", m.loop.real_time}, {"step", to_json(m.loop.step)}};
  j["joints"] = json::array();
  for (const CompareJoint& joint : m.joints) j["joints"].push_back(to_json(joint, with_blocks));
  j["curve"] = json::array();
  for (const CurvePoint& p : m.curve)
    j["curve"].push_back({{"share", p.share}, {"minutes", p.minutes}, {"rmse", p.rmse}});
  j["minutes_needed"] = m.minutes_needed();
  j["maps"] = json::array();
  for (const CompareMap& map : m.maps)
    j["maps"].push_back({{"joint", map.joint}, {"unit", map.unit}, {"rmse", map.rmse}});
  return j;
}

core::Status write_method(const MethodResult& result, const std::string& description,
                          const std::filesystem::path& folder) {
  return keep_result(folder, description, method_json(result, true));
}

core::Result<std::optional<MethodResult>> read_method(const std::string& description,
                                                      const std::filesystem::path& folder) {
  std::optional<MethodResult> result;
  RAVENCAL_ASSIGN_OR_RETURN(
      [[maybe_unused]] const bool there,
      take_result(folder, description, [&result](const json& j) { result = method_of(j); }));
  return result;
}

core::Result<Comparison> read_comparison(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  const auto damaged = [&](const std::string& why) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: is not what `ravencal compare` wrote: {}", path.string(), why)};
  };
  try {
    const json j = json::parse(text);
    if (j.at("schema") != kCompareSchema) return damaged("another schema");
    Comparison c;
    c.title = j.at("title");
    c.order = j.at("order");
    c.training_minutes = j.at("training_minutes");
    c.loop_budget_us = j.at("loop_budget_us");
    for (const auto& [name, value] : j.at("facts").items()) c.facts.emplace_back(name, value);
    for (const json& m : j.at("methods")) c.methods.push_back(method_of(m));
    return c;
  } catch (const json::exception& error) {
    return damaged(error.what());
  }
}

}  // namespace ravencal::study
