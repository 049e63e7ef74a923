// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/report/json_parts.hpp"
#include "diagnose/report/overview.hpp"
#include "diagnose/report/suggest.hpp"
#include "diagnose/report/write_report.hpp"

namespace ravencal::diagnose {
namespace {

Json intervals(const std::vector<Interval>& list) {
  Json out = Json::array();
  for (const Interval& i : list) out.push_back(interval(i));
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

/// Its name among channels[].points.
const char* series_over(Abscissa abscissa) {
  constexpr std::array kSeries = {"position", "speed", "load", "t_s"};
  return kSeries.at(static_cast<std::size_t>(abscissa));
}

Json effect_json(const NamedEffect& e) {
  Json parameters = Json::array();
  for (const NamedParameter& p : e.parameters) {
    parameters.push_back({{"name", p.name},
                          {"value", number(p.value)},
                          {"unit", p.unit},
                          {"ci95", {number(p.ci95.first), number(p.ci95.second)}}});
  }
  Json json = {{"id", e.id}, {"joint", e.joint}, {"stage", e.stage}};
  if (!e.from.empty()) json["from"] = e.from;
  if (e.probability) json["probability"] = number(*e.probability);
  json.update({{"parameters", std::move(parameters)},
               {"evidence",
                {{"held_out_before", number(e.held_out_before)},
                 {"held_out_after", number(e.held_out_after)},
                 {"held_out_share", number(held_out_share(e))},
                 {"unit", e.unit},
                 {"p_value", number(e.p_value)},
                 {"size", number(e.size)},
                 {"invariance_spread", number(e.invariance_spread)}}},
               {"ambiguous_with", e.ambiguous_with},
               {"separate_by", e.separate_by},
               {"shown_over", series_over(words_for(e.id).abscissa)},
               {"out_of_tolerance", e.out_of_tolerance}});
  return json;
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

Json held_out_json(const HeldOut& h) {
  Json recordings = Json::array();
  for (const RecordingFigure& f : h.by_recording) {
    recordings.push_back(
        {{"recording", f.recording}, {"before", number(f.before)}, {"after", number(f.after)}});
  }
  Json json = {{"joint", h.joint},
               {"metric", h.metric},
               {"figure", metric_words(h.metric)},
               {"unit", h.unit},
               {"before", number(h.before)},
               {"after", number(h.after)},
               {"floor", number(h.floor)},
               {"change", number(h.change())},
               {"change_ci95", interval(h.change_ci95)},
               {"by_recording", std::move(recordings)}};
  if (h.drawn_constant) json["drawn_constant"] = number(*h.drawn_constant);
  return json;
}

Json drift_json(const Drift& d) {
  return {{"joint", d.joint},
          {"unit", d.unit},
          {"horizon_s", number(d.horizon_s)},
          {"before", number(d.before)},
          {"refitted", number(d.refitted)},
          {"after", number(d.after)}};
}

Json error_left_json(const ErrorLeft& e) {
  const bool measured = e.measured_by != "none";
  return {{"joint", e.joint},
          {"stage", e.stage},
          {"unit", e.unit},
          {"before", number(e.before)},
          {"left", number(e.left)},
          {"measured_by", e.measured_by},
          {"floor", measured ? number(e.floor) : Json(nullptr)},
          {"compared_rows", e.compared_rows},
          {"agreement", number(e.agreement)},
          {"allowed", measured ? number(e.allowed) : Json(nullptr)},
          {"share_left", number(e.share())},
          {"reached", e.reached}};
}

Json recording_json(const SeenRecording& r) {
  return {{"name", r.name}, {"held_out", r.held_out}, {"duration_s", number(r.duration_s)}};
}

Json unexplained_json(const Unexplained& u) {
  return {
      {"joint", u.joint},       {"stage", u.stage}, {"share_of_excess", number(u.share_of_excess)},
      {"size", number(u.size)}, {"unit", u.unit},   {"depends_on", u.depends_on}};
}

Json routing_json(const Routing& r) {
  return {{"joint", r.joint},
          {"through", r.through},
          {"by_plant", r.by_plant},
          {"link_probability", number(r.link)},
          {"drive_probability", number(r.drive)}};
}

template <typename T>
Json array_of(const std::vector<T>& items, Json (*json_of)(const T&)) {
  Json out = Json::array();
  for (const T& item : items) out.push_back(json_of(item));
  return out;
}

/// What programs score: its fields keep name and meaning.
Json contract_of(const Report& report) {
  Json json;
  json["schema"] = 1;
  json["verdict"] = {{"kind", report.verdict.kind},
                     {"headline", headline(report.verdict)},
                     {"text", report.verdict.text},
                     {"false_alarm_rate", number(report.verdict.false_alarm_rate)},
                     {"placebo_twins", report.verdict.placebos}};
  json["mismatch"] = array_of(report.mismatch, mismatch_json);
  json["effects"] = array_of(report.effects, effect_json);
  json["kept_without_name"] = Json::array();
  json["held_out"] = array_of(report.held_out, held_out_json);
  json["drift"] = array_of(report.drift, drift_json);
  json["error_left"] = array_of(report.left, error_left_json);
  json["unexplained"] = array_of(report.unexplained, unexplained_json);
  json["not_found"] = array_of(report.not_found, not_found_json);
  json["known_together"] = array_of(report.combinations, combination_json);
  json["coupled_cables"] = array_of(report.routings, routing_json);
  return json;
}

}  // namespace

Json report_document(const Report& report) {
  Json json = contract_of(report);
  json["joints"] = joints_json(report);
  json["chain"] = chain_json(report);
  json["causes"] = causes_json(report);
  json["recordings"] = array_of(report.recordings, recording_json);
  json["looked_at"] = looked_at_json(report);
  json["not_looked_at"] = not_looked_at_json(report);
  json["candidates"] = candidates_json(report);
  Json provenance = Json::object();
  for (const auto& [key, value] : report.provenance) provenance[key] = value;
  json["provenance"] = std::move(provenance);
  json["channels"] = channels_json(report);
  json["next"] = suggestions_array(suggestions_of(json));
  return json;
}

std::string report_json(const Report& report) {
  // Most of the text are series, a number a line: one column of indentation.
  return report_document(report).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace ravencal::diagnose
