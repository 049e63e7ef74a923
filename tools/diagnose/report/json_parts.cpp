// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/json_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "diagnose/report/causes.hpp"
#include "diagnose/report/overview.hpp"

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

Json traces_json(const ChannelPlot& plot) {
  Json traces = Json::array();
  for (const Trace& t : plot.traces) {
    traces.push_back({{"recording", t.recording},
                      {"cross_validated", t.cross_validated},
                      {"fitted", t.fitted},
                      {"t_s", rounded(t.t_s)},
                      {"motion", rounded(t.motion)},
                      {"recorded", rounded(t.measured)},
                      {"before", rounded(t.nominal)},
                      {"after", rounded(t.refitted)}});
  }
  return traces;
}

Json where_json(const WhereMap& map) {
  const auto visited = std::count_if(map.before.begin(), map.before.end(),
                                     [](double v) { return std::isfinite(v); });
  return {{"cells", map.before.size()},
          {"cells_visited", visited},
          {"position_edges", rounded(map.position_edges)},
          {"speed_edges", rounded(map.speed_edges)},
          {"rows", map.rows},
          {"before", rounded(map.before)},
          {"after", rounded(map.after)}};
}

Json points_json(const ChannelPlot& plot) {
  return {{"t_s", rounded(plot.t_s)},       {"position", rounded(plot.position)},
          {"speed", rounded(plot.speed)},   {"load", rounded(plot.load)},
          {"hold_s", rounded(plot.hold_s)}, {"before", rounded(plot.before)},
          {"after", rounded(plot.after)}};
}

Json channel_json(const ChannelPlot& plot) {
  Json waterfall = Json::array();
  for (const WaterfallStep& step : plot.waterfall)
    waterfall.push_back({{"step", step.name}, {"rmse", number(step.rms)}});
  Json scales = Json::array();
  for (const RegimeScale& s : plot.scales) {
    scales.push_back({{"effect", s.effect},
                      {"circumstance", s.regime},
                      {"scale", number(s.scale)},
                      {"deviation", number(s.error)}});
  }
  return {{"joint", plot.joint},
          {"stage", plot.stage},
          {"unit", plot.unit},
          {"position_unit", plot.position_unit},
          {"load_unit", plot.load_unit},
          {"floor", number(plot.floor)},
          {"waterfall", std::move(waterfall)},
          {"scales", std::move(scales)},
          {"where", where_json(plot.where)},
          {"traces", traces_json(plot)},
          {"points", points_json(plot)}};
}

}  // namespace

Json channels_json(const Report& report) {
  Json channels = Json::array();
  for (const ChannelPlot& plot : report.plots) channels.push_back(channel_json(plot));
  return channels;
}

Json candidates_json(const Report& report) {
  Json candidates = Json::array();
  for (const CandidateRow& c : report.candidates) {
    candidates.push_back({{"joint", c.joint},
                          {"stage", c.stage},
                          {"id", c.id},
                          {"gain_share", number(c.gain_share)},
                          {"z", number(c.z)},
                          {"p_value", number(c.p_value)},
                          {"size", number(c.size)},
                          {"unit", c.unit},
                          {"outcome", c.outcome}});
  }
  return candidates;
}

Json looked_at_json(const Report& report) {
  Json list = Json::array();
  for (const LookedAt& l : report.looked_at) {
    list.push_back({{"joint", l.joint},
                    {"stage", l.stage},
                    {"rows", l.rows},
                    {"held_out_rows", l.held_out_rows},
                    {"band_hz", interval(l.band_hz)},
                    {"position", interval(l.position)},
                    {"position_unit", l.position_unit},
                    {"fastest", number(l.fastest)},
                    {"rest_share", number(l.rest_share)},
                    {"load", interval(l.load)},
                    {"effort_unit", l.effort_unit},
                    {"circumstances", l.circumstances}});
  }
  return list;
}

Json not_looked_at_json(const Report& report) {
  Json list = Json::array();
  for (const NotLookedAt& n : report.not_looked_at)
    list.push_back({{"joint", n.joint}, {"stage", n.stage}, {"because", n.because}});
  return list;
}

Json joints_json(const Report& report) {
  Json list = Json::array();
  for (const JointLine& line : joint_lines(report, causes_of(report))) {
    list.push_back(
        {{"joint", line.joint},
         {"sentence", line.sentence},
         {"metric", line.figure != nullptr ? Json(line.figure->metric) : Json(nullptr)}});
  }
  return list;
}

Json chain_json(const Report& report) {
  Json list = Json::array();
  for (const ChainCell& cell : chain_of(report)) {
    Json json = {{"joint", cell.joint}, {"stage", cell.stage}, {"effects", cell.effects}};
    if (cell.figure != nullptr) {
      json["metric"] = cell.figure->metric;
      json["unit"] = cell.figure->unit;
      json["before"] = number(cell.figure->before);
      json["after"] = number(cell.figure->after);
      json["share_before"] = number(cell.share_before);
      json["share_after"] = number(cell.share_after);
    } else {
      json["without_figure"] = cell.without_figure;
    }
    list.push_back(std::move(json));
  }
  return list;
}

Json causes_json(const Report& report) {
  Json list = Json::array();
  for (const Cause& cause : causes_of(report)) {
    Json partings = Json::array();
    for (const Parting& p : cause.partings) {
      partings.push_back({{"id", p.id},
                          {"rival", p.rival},
                          {"experiment", p.experiment},
                          {"minutes", number(p.minutes)}});
    }
    list.push_back({{"name", cause.name},
                    {"sentence", cause.sentence},
                    {"status", cause.status},
                    {"joints", cause.joints},
                    {"effects", cause.effects},
                    {"partings", std::move(partings)}});
  }
  return list;
}

}  // namespace ravencal::diagnose
