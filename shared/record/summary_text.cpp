// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "record/csv_number.hpp"
#include "record/summary.hpp"

namespace ravencal::record {
namespace {

constexpr std::size_t kChannelsShown = 4;
constexpr std::size_t kEventsShown = 5;

std::string meta_or(const Recording& recording, const std::string& key,
                    std::string_view otherwise) {
  const auto it = recording.meta.find(key);
  return it == recording.meta.end() ? std::string(otherwise) : it->second;
}

void append_channels(std::string& text, const Summary& summary) {
  std::map<Role, std::vector<const ChannelSummary*>> by_role;
  for (const ChannelSummary& channel : summary.channels) {
    by_role[channel.channel.role].push_back(&channel);
  }
  auto out = std::back_inserter(text);
  for (const auto& [role, channels] : by_role) {
    fmt::format_to(out, "{} ({}):\n", name_of(role), channels.size());
    const bool all = role != Role::kFeature || channels.size() <= kChannelsShown;
    const std::size_t count = all ? channels.size() : kChannelsShown;
    for (std::size_t i = 0; i < count; ++i) {
      const ChannelSummary& c = *channels[i];
      fmt::format_to(out, "  {:<28} {:>12.6g} .. {:<12.6g} {}{}\n", c.channel.name, c.min, c.max,
                     c.channel.unit, c.lost == 0 ? "" : fmt::format(", {} lost", c.lost));
    }
    if (!all) fmt::format_to(out, "  ... and {} more\n", channels.size() - count);
  }
}

void append_events(std::string& text, const Recording& recording) {
  std::map<std::string, std::size_t> kinds;
  for (const Event& event : recording.events) ++kinds[event.kind];
  auto out = std::back_inserter(text);
  if (kinds.empty()) fmt::format_to(out, "events: none\n");
  for (const auto& [kind, count] : kinds) {
    fmt::format_to(out, "events of kind {}: {}\n", kind, count);
    std::size_t shown_count = 0;
    for (const Event& event : recording.events) {
      if (event.kind != kind || ++shown_count > kEventsShown) continue;
      fmt::format_to(out, "  {:.3f} s  {}\n", static_cast<double>(event.t_ns) * 1e-9, event.detail);
    }
    if (count > kEventsShown) fmt::format_to(out, "  ... and {} more\n", count - kEventsShown);
  }
}

void append_errors(std::string& text, const Summary& summary) {
  auto out = std::back_inserter(text);
  if (summary.joints.empty()) {
    fmt::format_to(out, "raw error: unknown, no joint has both an estimate and a truth\n");
    return;
  }
  fmt::format_to(out, "raw error, truth - estimate:\n");
  for (const JointErrorSummary& joint : summary.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    fmt::format_to(out, "  {:<12} RMSE {:8.4f}, bias {:+8.4f}, peak {:8.4f} {} over {} samples\n",
                   joint.joint, joint.rmse * unit.per_si, joint.bias * unit.per_si,
                   joint.peak * unit.per_si, unit.name, joint.samples);
  }
}

void append_implausible(std::string& text, const Summary& summary) {
  for (const Implausibility& doubt : summary.implausible)
    text += fmt::format("{}: {}\n", doubt.is_error ? "no robot moves like that" : "implausible",
                        doubt.sentence);
}

}  // namespace

std::vector<std::string> assumptions_of(const Recording& recording, std::string_view name) {
  std::vector<std::string> sentences;
  const auto meta = [&](const char* key) { return meta_or(recording, key, ""); };
  if (const std::string period_s = meta("assumed_row_period_s"); !period_s.empty()) {
    sentences.push_back(fmt::format(
        "{} has no time in each row, so that its rows count as {} s apart; the sample time was "
        "assumed: {:g} ms (the profile's time = \"COLUMN\" or row_period_s, without `assumed = "
        "true`, says how "
        "far they are)",
        name, period_s, 1e3 * number_of(period_s).value_or(0.0)));
  }
  if (const std::string unit = meta("assumed_time_unit"); !unit.empty()) {
    sentences.push_back(
        fmt::format("the unit of the time of {} was assumed: {} (delete `assumed = true` in the "
                    "[source] of its profile when it is right)",
                    name, unit));
  }
  if (const std::string channels = meta("assumed_channels"); !channels.empty()) {
    sentences.push_back(fmt::format(
        "the unit, the joint or the sign of these channels of {} is an assumption of its profile "
        "(delete `assumed = true` there when it is right): {}",
        name, channels));
  }
  return sentences;
}

std::string describe_in_words(const Recording& recording, const Summary& summary) {
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out, "{}: a recording of {}, arm {}\n", recording.source,
                 meta_or(recording, "robot", "an unnamed robot"),
                 meta_or(recording, "arm", "not named"));
  fmt::format_to(out, "{} rows, {:.3f} s, {:.4g} Hz, {} channels\n", summary.rows,
                 summary.duration_s, summary.rate_hz, summary.channels.size());
  if (summary.gaps == 0) {
    fmt::format_to(out, "gaps: none longer than 3 periods\n");
  } else {
    fmt::format_to(out, "gaps longer than 3 periods: {}, the longest {:.3f} s\n", summary.gaps,
                   summary.longest_gap_s);
  }
  for (const std::string& assumption : assumptions_of(recording, recording.source))
    fmt::format_to(out, "assumed: {}\n", assumption);
  append_errors(text, summary);
  append_implausible(text, summary);
  append_events(text, recording);
  append_channels(text, summary);
  return text;
}

std::string describe_in_json(const Recording& recording, const Summary& summary) {
  using nlohmann::ordered_json;
  ordered_json channels = ordered_json::array();
  for (const ChannelSummary& c : summary.channels) {
    channels.push_back({{"name", c.channel.name},
                        {"unit", c.channel.unit},
                        {"role", name_of(c.channel.role)},
                        {"joint", c.channel.joint},
                        {"min", c.min},
                        {"max", c.max},
                        {"lost", c.lost}});
  }
  ordered_json joints = ordered_json::array();
  for (const JointErrorSummary& j : summary.joints) {
    joints.push_back({{"joint", j.joint},
                      {"unit", j.unit},
                      {"samples", j.samples},
                      {"raw", {{"rmse", j.rmse}, {"bias", j.bias}, {"peak", j.peak}}}});
  }
  ordered_json implausible = ordered_json::array();
  for (const Implausibility& d : summary.implausible) {
    implausible.push_back({{"kind", d.kind},
                           {"channel", d.channel},
                           {"figure", d.figure},
                           {"t_ns", d.t_ns},
                           {"is_error", d.is_error},
                           {"sentence", d.sentence}});
  }
  ordered_json events = ordered_json::array();
  for (const Event& e : recording.events) {
    events.push_back({{"t_ns", e.t_ns}, {"kind", e.kind}, {"detail", e.detail}});
  }
  const ordered_json root = {{"kind", "recording"},
                             {"file", recording.source},
                             {"meta", recording.meta},
                             {"rows", summary.rows},
                             {"duration_s", summary.duration_s},
                             {"rate_hz", summary.rate_hz},
                             {"gaps", summary.gaps},
                             {"longest_gap_s", summary.longest_gap_s},
                             {"joints", joints},
                             {"implausible", implausible},
                             {"events", events},
                             {"channels", channels}};
  return root.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace ravencal::record
