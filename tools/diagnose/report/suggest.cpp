// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/suggest.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "diagnose/findings/words.hpp"
#include "diagnose/report/json.hpp"

namespace ravencal::diagnose {
namespace {

void add_ties(const Json& report, std::vector<Suggestion>& out) {
  for (const Json& effect : report.at("effects")) {
    const std::string id = effect.at("id");
    for (const Json& rival : effect.at("ambiguous_with")) {
      const std::string other = rival;
      const Experiment* p = cheapest_parting(id, other);
      out.push_back(
          {0,
           effect.at("joint"),
           p ? std::string(p->experiment) : effect.at("separate_by").get<std::string>(),
           p ? p->minutes : 10.0,
           fmt::format("joint {}: parts {} from {}", effect.at("joint").get<std::string>(),
                       words_of(id), words_of(other)),
           p ? p->motion : Exercise::kNone,
           {id, other}});
    }
  }
}

void add_unexplained(const Json& report, std::vector<Suggestion>& out) {
  for (const Json& u : report.at("unexplained")) {
    const auto depends = u.at("depends_on").get<std::vector<std::string>>();
    const std::string joint = u.at("joint");
    const Experiment& over = experiment_over(depends.empty() ? "" : depends.front());
    out.push_back({1,
                   joint,
                   std::string(over.experiment),
                   over.minutes,
                   fmt::format("joint {}, {}: {:.0f} % of the excess has no name{}", joint,
                               u.at("stage").get<std::string>(),
                               100.0 * u.at("share_of_excess").get<double>(),
                               depends.empty() ? "" : "; it depends on " + depends.front()),
                   over.motion,
                   {}});
  }
}

/// Effects that one experiment would test and that one reason kept from being tested.
struct Untested {
  const Experiment* experiment;
  std::string why;
  std::string first_id;
  std::vector<std::string> effects, joints;  ///< in words
};

void add_untested(const Json& report, std::vector<Suggestion>& out) {
  std::vector<Untested> groups;
  for (const Json& n : report.at("not_found")) {
    if (!n.value("by_recording", false)) continue;
    const std::string id = n.at("id");
    const std::string why = n.at("not_testable_because");
    const Experiment* p = cheapest_test(id);
    if (p == nullptr) continue;
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const Untested& g) { return g.experiment == p && g.why == why; });
    if (group == groups.end()) group = groups.insert(groups.end(), {p, why, id, {}, {}});
    add_once(group->effects, words_of(id));
    add_once(group->joints, n.at("joint"));
  }
  for (const Untested& g : groups) {
    out.push_back({2,
                   g.joints.front(),
                   std::string(g.experiment->experiment),
                   g.experiment->minutes,
                   fmt::format("joint {}: tests {}, not testable so far: {}",
                               fmt::join(g.joints, ", "), fmt::join(g.effects, ", "), g.why),
                   g.experiment->motion,
                   {g.first_id}});
  }
}

/// Where the recordings did not go: a finding, or that there is none, holds where they went.
/// Reports of earlier versions do not say where that is.
void add_confirmations(const Json& report, std::vector<Suggestion>& out) {
  if (!report.contains("recordings") || report.at("recordings").empty()) return;
  double longest_s = 0.0;
  bool held_out = false;
  for (const Json& r : report.at("recordings")) {
    longest_s = std::max(longest_s, r.at("duration_s").get<double>());
    held_out = held_out || r.at("held_out").get<bool>();
  }
  const double minutes = longest_s / 60.0;
  const auto add = [&](const std::string& joint, const char* experiment, double takes,
                       std::string why) {
    out.push_back({3, joint, experiment, takes, std::move(why), Exercise::kNone, {}});
  };
  for (const Json& channel : report.at("channels")) {
    const std::size_t cells = channel.at("where").at("cells");
    const std::size_t visited = channel.at("where").at("cells_visited");
    if (visited == cells) continue;
    add(channel.at("joint"), "visit the positions and speeds that these recordings leave out",
        minutes,
        fmt::format("joint {}, {}: {} of {} cells of position and speed hold rows",
                    channel.at("joint").get<std::string>(), channel.at("stage").get<std::string>(),
                    visited, cells));
  }
  if (!held_out)
    add("", "record another motion and hold it out", minutes,
        "no recording was held out: every figure is of rows that were fitted");
  add("", "home anew and record the same motion on another day", minutes,
      "the findings hold for the homings that were recorded");
}

/// One entry per experiment and urgency, its reasons joined.
std::vector<Suggestion> merged(std::vector<Suggestion> all) {
  std::stable_sort(all.begin(), all.end(), [](const Suggestion& a, const Suggestion& b) {
    return a.urgency != b.urgency ? a.urgency < b.urgency : a.minutes < b.minutes;
  });
  std::vector<Suggestion> out;
  for (Suggestion& s : all) {
    const auto same = std::find_if(
        out.begin(), out.end(), [&](const Suggestion& o) { return o.experiment == s.experiment; });
    if (same == out.end()) {
      out.push_back(std::move(s));
    } else if (same->urgency == s.urgency && same->why.size() < 400 &&
               same->why.find(s.why) == std::string::npos) {
      same->why += "; " + s.why;
    }
  }
  return out;
}

/// Of the stages that show a joint the one that saw most of it.
std::vector<Explored> explored_in(const Json& report) {
  std::vector<Explored> out;
  if (!report.contains("looked_at")) return out;
  for (const Json& l : report.at("looked_at")) {
    Explored seen{l.at("joint"),    l.at("position_unit"), l.at("effort_unit"),
                  l.at("position"), l.at("fastest"),       std::nullopt};
    if (l.contains("load") && !l.at("load").is_null()) seen.load = l.at("load").get<Interval>();
    const auto same = std::find_if(out.begin(), out.end(),
                                   [&](const Explored& e) { return e.joint == seen.joint; });
    if (same == out.end()) {
      out.push_back(std::move(seen));
      continue;
    }
    same->position.first = std::min(same->position.first, seen.position.first);
    same->position.second = std::max(same->position.second, seen.position.second);
    same->fastest = std::max(same->fastest, seen.fastest);
    if (!same->load) same->load = seen.load;
  }
  return out;
}

}  // namespace

std::vector<Suggestion> suggestions_of(const Json& report) {
  std::vector<Suggestion> all;
  add_ties(report, all);
  add_unexplained(report, all);
  add_untested(report, all);
  add_confirmations(report, all);
  return merged(std::move(all));
}

core::Result<Next> suggest(std::string_view report_json, const std::string& source) {
  try {
    const Json report = Json::parse(report_json);
    if (report.at("schema") != 1) {
      return core::data_error(
          fmt::format("{}: schema {} is not 1", source, report.at("schema").dump()));
    }
    return Next{suggestions_of(report), explored_in(report)};
  } catch (const Json::exception& error) {
    return core::data_error(
        fmt::format("{}: not a report of `ravencal diagnose`: {}", source, error.what()));
  }
}

RAVENCAL_JSON_MEMBERS(Suggestion, urgency, joint, experiment, minutes, why);
RAVENCAL_JSON_MEMBERS(Explored, joint, position, position_unit, fastest, load, effort_unit);

}  // namespace ravencal::diagnose
