// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "diagnose/report/write_report.hpp"

namespace ravencal::diagnose {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json intervals(const std::vector<Interval>& list) {
  Json out = Json::array();
  for (const auto& [a, b] : list) out.push_back({number(a), number(b)});
  return out;
}

Json mismatch_json(const Mismatch& m) {
  return {{"joint", m.joint},
          {"stage", m.stage},
          {"where",
           {{"regime", m.regime},
            {"interval_s", intervals(m.interval_s)},
            {"position", intervals(m.position)}}},
          {"excess_rmse", number(m.excess_rmse)},
          {"floor", number(m.floor)},
          {"unit", m.unit},
          {"p_value", number(m.p_value)}};
}

Json effect_json(const NamedEffect& e) {
  Json parameters = Json::array();
  for (const NamedParameter& p : e.parameters) {
    parameters.push_back({{"name", p.name},
                          {"value", number(p.value)},
                          {"unit", p.unit},
                          {"ci95", {number(p.ci95.first), number(p.ci95.second)}}});
    if (p.running) parameters.back()["in_free_run"] = number(*p.running);
  }
  return {{"id", e.id},
          {"joint", e.joint},
          {"stage", e.stage},
          {"parameters", std::move(parameters)},
          {"evidence",
           {{"held_out_before", number(e.held_out_before)},
            {"held_out_after", number(e.held_out_after)},
            {"unit", e.unit},
            {"p_value", number(e.p_value)},
            {"size", number(e.size)},
            {"invariance_spread", number(e.invariance_spread)}}},
          {"ambiguous_with", e.ambiguous_with},
          {"separate_by", e.separate_by},
          {"out_of_tolerance", e.out_of_tolerance}};
}

Json combination_json(const Combination& c) {
  Json parameters = Json::array();
  for (const CombinedParameter& p : c.parameters) {
    parameters.push_back({{"id", p.id},
                          {"name", p.name},
                          {"power", number(p.power)},
                          {"relative_deviation", number(p.relative_deviation)}});
  }
  return {{"joint", c.joint},
          {"stage", c.stage},
          {"parameters", std::move(parameters)},
          {"value", number(c.value)},
          {"ci95", {number(c.ci95.first), number(c.ci95.second)}}};
}

Json not_found_json(const NotFound& n) {
  Json json = {{"id", n.id}, {"joint", n.joint}};
  if (n.detection_limit) {
    json["detection_limit"] = number(*n.detection_limit);
    json["unit"] = n.unit;
    json["parameter"] = n.parameter;
  } else {
    json["not_testable_because"] = n.not_testable_because;
  }
  if (n.expected) json["expected"] = true;
  return json;
}

}  // namespace

std::string report_json(const Report& report) {
  Json json;
  json["schema"] = 1;
  json["verdict"] = {
      {"kind", report.verdict.kind},
      {"text", report.verdict.text},
      {"false_alarm_rate",
       report.verdict.false_alarm_rate ? number(*report.verdict.false_alarm_rate) : Json(nullptr)}};
  json["mismatch"] = Json::array();
  for (const Mismatch& m : report.mismatch) json["mismatch"].push_back(mismatch_json(m));
  json["effects"] = Json::array();
  for (const NamedEffect& e : report.effects) json["effects"].push_back(effect_json(e));
  json["kept_without_name"] = Json::array();
  for (const NamedEffect& e : report.kept) json["kept_without_name"].push_back(effect_json(e));
  json["held_out"] = Json::array();
  for (const HeldOut& h : report.held_out) {
    json["held_out"].push_back({{"joint", h.joint},
                                {"metric", h.metric},
                                {"unit", h.unit},
                                {"before", number(h.before)},
                                {"after", number(h.after)},
                                {"floor", number(h.floor)}});
  }
  json["unexplained"] = Json::array();
  for (const Unexplained& u : report.unexplained) {
    json["unexplained"].push_back({{"joint", u.joint},
                                   {"stage", u.stage},
                                   {"share_of_excess", number(u.share_of_excess)},
                                   {"size", number(u.size)},
                                   {"unit", u.unit},
                                   {"depends_on", u.depends_on}});
  }
  json["not_found"] = Json::array();
  for (const NotFound& n : report.not_found) json["not_found"].push_back(not_found_json(n));
  json["known_together"] = Json::array();
  for (const Combination& c : report.combinations)
    json["known_together"].push_back(combination_json(c));
  Json provenance = Json::object();
  for (const auto& [key, value] : report.provenance) provenance[key] = value;
  json["provenance"] = std::move(provenance);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace ravencal::diagnose
