// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/figures.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/report/overview.hpp"
#include "diagnose/report/suggest.hpp"

namespace ravencal::diagnose {
namespace {

/// More digits than a chart shows cost more than they say.
Json rounded(const std::vector<double>& values) {
  Json out = Json::array();
  for (const double v : values) {
    out.push_back(std::isfinite(v) ? Json(std::strtod(fmt::format("{:.5g}", v).c_str(), nullptr))
                                   : Json(nullptr));
  }
  return out;
}

/// Its name among channels[].points.
const char* series_over(Abscissa abscissa) {
  constexpr std::array kSeries = {"position", "speed", "load", "t_s"};
  return kSeries.at(static_cast<std::size_t>(abscissa));
}

}  // namespace

// The library finds these by their argument, hence not in an unnamed namespace.

static RAVENCAL_JSON_MEMBERS(NamedParameter, name, value, unit, ci95);
static RAVENCAL_JSON_MEMBERS(Sides, encoder, gearbox, decided_by);
static RAVENCAL_JSON_MEMBERS(CombinedParameter, id, name, power, relative_deviation);
static RAVENCAL_JSON_MEMBERS(Combination, joint, stage, parameters, value, ci95);
static RAVENCAL_JSON_MEMBERS(RecordingFigure, recording, before, after);
static RAVENCAL_JSON_MEMBERS(Drift, joint, unit, horizon_s, before, refitted, after);
static RAVENCAL_JSON_MEMBERS(TwoEstimates, joint, id, parameter, unit, equation_error,
                             equation_error_ci95, free_run, free_run_ci95, allowed, agree);
static RAVENCAL_JSON_MEMBERS(SeenRecording, name, held_out, duration_s);
static RAVENCAL_JSON_MEMBERS(Unexplained, joint, stage, share_of_excess, size, unit, depends_on);
static RAVENCAL_JSON_MEMBERS(WaterfallStep, step, rmse);
static RAVENCAL_JSON_MEMBERS(RegimeScale, effect, circumstance, scale, deviation);
static RAVENCAL_JSON_MEMBERS(CandidateRow, joint, stage, id, gain_share, z, p_value, size, unit,
                             outcome);
static RAVENCAL_JSON_MEMBERS(LookedAt, joint, stage, rows, held_out_rows, band_hz, position,
                             position_unit, fastest, above_band, rest_share, load, effort_unit,
                             circumstances);
static RAVENCAL_JSON_MEMBERS(NotLookedAt, joint, stage, because);
static RAVENCAL_JSON_MEMBERS(Parting, id, rival, experiment, minutes);
static RAVENCAL_JSON_MEMBERS(Cause, name, sentence, status, joints, effects, partings);

static void to_json(Json& json, const Verdict& v) {
  json = {{"kind", v.kind},
          {"headline", headline(v)},
          {"text", v.text},
          {"false_alarm_rate", v.false_alarm_rate},
          {"placebo_twins", v.placebos}};
}

static void to_json(Json& json, const Mismatch& m) {
  json = {{"joint", m.joint},
          {"stage", m.stage},
          {"where", {{"regime", m.regime}, {"interval_s", m.interval_s}, {"position", m.position}}},
          {"excess_rmse", m.excess_rmse},
          {"floor", m.floor},
          {"unit", m.unit},
          {"p_value", m.p_value}};
}

static void to_json(Json& json, const NamedEffect& e) {
  json = {{"id", e.id}, {"joint", e.joint}, {"stage", e.stage}};
  if (!e.from.empty()) json["from"] = e.from;
  if (e.probability) json["probability"] = *e.probability;
  json.update({{"parameters", e.parameters},
               {"evidence",
                {{"held_out_before", e.held_out_before},
                 {"held_out_after", e.held_out_after},
                 {"held_out_share", held_out_share(e)},
                 {"rows", e.of_fitted_rows ? "fitted" : "held_out"},
                 {"unit", e.unit},
                 {"p_value", e.p_value},
                 {"size", e.size},
                 {"invariance_spread", e.invariance_spread}}},
               {"ambiguous_with", e.ambiguous_with},
               {"separate_by", e.separate_by},
               {"shown_over", series_over(words_for(e.id).abscissa)},
               {"out_of_tolerance", e.out_of_tolerance}});
  if (e.sides) json["sides"] = *e.sides;
}

static void to_json(Json& json, const NotFound& n) {
  json = {{"id", n.id}, {"joint", n.joint}};
  if (n.detection_limit) {
    json["detection_limit"] = *n.detection_limit;
    json["unit"] = n.unit;
    json["parameter"] = n.parameter;
  } else {
    json["not_testable_because"] = n.not_testable_because;
    json["by_recording"] = n.by_recording;
  }
}

static void to_json(Json& json, const HeldOut& h) {
  json = {{"joint", h.joint},
          {"metric", h.metric},
          {"figure", metric_words(h.metric)},
          {"unit", h.unit},
          {"before", h.before},
          {"after", h.after},
          {"floor", h.floor},
          {"change", h.change()},
          {"change_ci95", h.change_ci95},
          {"by_recording", h.by_recording}};
  if (h.drawn_constant) json["drawn_constant"] = *h.drawn_constant;
}

static void to_json(Json& json, const ErrorLeft& e) {
  const bool measured = e.measured_by != "none";
  json = {{"joint", e.joint},
          {"stage", e.stage},
          {"unit", e.unit},
          {"before", e.before},
          {"left", e.left},
          {"measured_by", e.measured_by},
          {"floor", measured ? Json(e.floor) : Json(nullptr)},
          {"compared_rows", e.compared_rows},
          {"agreement", e.agreement},
          {"allowed", measured ? Json(e.allowed) : Json(nullptr)},
          {"share_left", e.share()},
          {"of_signal", e.of_signal},
          {"reached", e.reached}};
}

static void to_json(Json& json, const Routing& r) {
  json = {{"joint", r.joint},
          {"through", r.through},
          {"by_plant", r.by_plant},
          {"link_probability", r.link},
          {"drive_probability", r.drive}};
}

static void to_json(Json& json, const Trace& t) {
  json = {{"recording", t.recording},     {"cross_validated", t.cross_validated},
          {"fitted", t.fitted},           {"t_s", rounded(t.t_s)},
          {"motion", rounded(t.motion)},  {"recorded", rounded(t.measured)},
          {"before", rounded(t.nominal)}, {"after", rounded(t.refitted)}};
}

static void to_json(Json& json, const WhereMap& map) {
  const auto visited =
      std::count_if(map.rows.begin(), map.rows.end(), [](std::size_t rows) { return rows > 0; });
  json = {{"cells", map.before.size()},
          {"cells_visited", visited},
          {"position_edges", rounded(map.position_edges)},
          {"speed_edges", rounded(map.speed_edges)},
          {"rows", map.rows},
          {"before", rounded(map.before)},
          {"after", rounded(map.after)}};
}

static void to_json(Json& json, const ChannelPlot& plot) {
  const Json points = {{"t_s", rounded(plot.t_s)},       {"position", rounded(plot.position)},
                       {"speed", rounded(plot.speed)},   {"load", rounded(plot.load)},
                       {"hold_s", rounded(plot.hold_s)}, {"before", rounded(plot.before)},
                       {"after", rounded(plot.after)}};
  json = {{"joint", plot.joint},
          {"stage", plot.stage},
          {"unit", plot.unit},
          {"position_unit", plot.position_unit},
          {"load_unit", plot.load_unit},
          {"floor", plot.floor},
          {"waterfall", plot.waterfall},
          {"scales", plot.scales},
          {"where", plot.where},
          {"traces", plot.traces},
          {"points", points}};
}

static void to_json(Json& json, const JointLine& line) {
  json = {{"joint", line.joint},
          {"sentence", line.sentence},
          {"metric", line.figure != nullptr ? Json(line.figure->metric) : Json(nullptr)}};
}

static void to_json(Json& json, const ChainCell& cell) {
  json = {{"joint", cell.joint}, {"stage", cell.stage}, {"effects", cell.effects}};
  if (cell.figure == nullptr) {
    json["without_figure"] = cell.without_figure;
    return;
  }
  json.update({{"metric", cell.figure->metric},
               {"unit", cell.figure->unit},
               {"before", cell.figure->before},
               {"after", cell.figure->after},
               {"share_before", cell.share_before},
               {"share_after", cell.share_after}});
}

Json report_document(const Report& report) {
  const std::vector<Cause> causes = causes_of(report);
  // What programs score comes first: its fields keep name and meaning.
  Json json = {{"schema", 1},
               {"verdict", report.verdict},
               {"mismatch", report.mismatch},
               {"effects", report.effects},
               {"kept_without_name", Json::array()},
               {"held_out", report.held_out},
               {"drift", report.drift},
               {"two_estimates", report.two_estimates},
               {"error_left", report.left},
               {"unexplained", report.unexplained},
               {"not_found", report.not_found},
               {"known_together", report.combinations},
               {"coupled_cables", report.routings},
               {"joints", joint_lines(report, causes)},
               {"chain", chain_of(report, causes)},
               {"causes", causes},
               {"recordings", report.recordings},
               {"looked_at", report.looked_at},
               {"not_looked_at", report.not_looked_at},
               {"candidates", report.candidates},
               {"provenance", Json::object()},
               {"channels", report.plots}};
  for (const auto& [key, value] : report.provenance) json["provenance"][key] = value;
  json["next"] = suggestions_of(json);
  return json;
}

}  // namespace ravencal::diagnose
