// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/overview.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "diagnose/findings/figures.hpp"
#include "diagnose/findings/verdict.hpp"
#include "diagnose/findings/words.hpp"

namespace ravencal::diagnose {
namespace {

using Words = std::pair<std::string_view, std::string_view>;

std::vector<std::string> joints_of(const Report& report) {
  std::vector<std::string> joints;
  const auto add = [&](const auto& list) {
    for (const auto& item : list) add_once(joints, item.joint);
  };
  // Each of these names every joint of the plant in its order, as far as it goes.
  add(report.not_found);
  add(report.looked_at);
  add(report.not_looked_at);
  add(report.effects);
  return joints;
}

std::string reason_without_figure(const Report& report, const std::string& joint,
                                  std::string_view stage) {
  if (stage == "joint") return "not run";
  // What a sensor does is seen between the transmission's two ends.
  const NotLookedAt place{joint, std::string(stage == "sensor" ? "transmission" : stage), {}};
  return at_place_of(place, report.looked_at) ? "nothing found" : "not recorded";
}

bool acts_on(const Cause& cause, const std::string& joint) {
  return std::find(cause.joints.begin(), cause.joints.end(), joint) != cause.joints.end();
}

/// Ids that act there: a load on the arm does on every drive.
std::vector<std::string> effects_at(const Report& report, const std::vector<Cause>& causes,
                                    const std::string& joint, std::string_view stage) {
  std::vector<std::string> ids;
  for (const Cause& cause : causes) {
    if (!acts_on(cause, joint)) continue;
    for (const std::size_t i : cause.effects) {
      const NamedEffect& e = report.effects[i];
      if (e.stage == stage) add_once(ids, e.id);
    }
  }
  return ids;
}

ChainCell cell_of(const Report& report, const std::vector<Cause>& causes, const std::string& joint,
                  std::string_view stage) {
  ChainCell cell;
  cell.joint = joint;
  cell.stage = stage;
  cell.effects = effects_at(report, causes, joint, stage);
  cell.figure = figure_of_stage(report, joint, stage);
  if (cell.figure == nullptr) {
    if (cell.effects.empty()) cell.without_figure = reason_without_figure(report, joint, stage);
    return cell;
  }
  const double whole = std::pow(cell.figure->before, 2);
  const auto above_floor = [&](double rms) {
    return whole > 0.0
               ? std::max(0.0, (rms * rms - std::pow(cell.figure->floor.value_or(0.0), 2)) / whole)
               : 0.0;
  };
  cell.share_before = above_floor(cell.figure->before);
  cell.share_after = above_floor(cell.figure->after);
  return cell;
}

/// Names of the causes of that status which act on the joint.
std::vector<std::string> names_of(const std::vector<Cause>& causes, const std::string& joint,
                                  std::string_view status) {
  std::vector<std::string> names;
  for (const Cause& cause : causes) {
    if (!acts_on(cause, joint) || cause.status != status) continue;
    std::string name = cause.name;
    std::vector<std::string> rivals;
    for (const Parting& parting : cause.partings) add_once(rivals, words_of(parting.rival));
    if (!rivals.empty()) name += fmt::format(" (or {})", fmt::join(rivals, ", "));
    names.push_back(std::move(name));
  }
  return names;
}

std::string findings_words(const std::vector<Cause>& causes, const std::string& joint) {
  constexpr std::array<Words, 4> kStatus = {{{"named", "missing in the plant: "},
                                             {"tied", "missing in the plant, one of several: "},
                                             {"out_of_tolerance", "beyond the plant's tolerance: "},
                                             {"no_name", ""}}};
  std::vector<std::string> parts;
  for (const auto& [status, words] : kStatus) {
    const auto names = names_of(causes, joint, status);
    if (names.empty()) continue;
    parts.push_back(status == "no_name" ? std::string("something real has no name")
                                        : fmt::format("{}{}", words, fmt::join(names, ", ")));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

std::string percent_figure(double share) {
  const double value = 100.0 * share;
  // Near a whole fall the tenths tell.
  const int decimals = std::abs(value) < 10.0 || value < -95.0 ? 1 : 0;
  return fmt::format("{}{:.{}f}", value < 0.0 ? "−" : "+", std::abs(value), decimals);
}

/// "position error on motion that no fit saw 2 deg, now 0.3 deg (−85 %, 95 %: −90 to −80 %)".
std::string change_words(const HeldOut& figure, bool fitted) {
  std::string text =
      fmt::format("{} {} {}, now {} ({} %", metric_words(figure.metric), rows_words(fitted),
                  quantity(figure.before, figure.unit), quantity(figure.after, figure.unit),
                  percent_figure(figure.change()));
  if (figure.change_ci95) {
    text += fmt::format(", 95 %: {} to {} %", percent_figure(figure.change_ci95->first),
                        percent_figure(figure.change_ci95->second));
  }
  text += ")";
  if (figure.drawn_constant)
    text += fmt::format(", beside the constant of {} that homing draws",
                        quantity(*figure.drawn_constant, figure.unit));
  return text;
}

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// What of a joint's findings its figures cannot show.
std::string kept_out_words(const Report& report, const std::string& joint) {
  std::vector<std::string> names;
  for (const NamedEffect& effect : report.effects)
    if (effect.beyond_plants && effect.joint == joint) add_once(names, words_of(effect.id));
  if (names.empty()) return {};
  return fmt::format("; no plant can hold {}, so that its error stays in this figure",
                     fmt::join(names, " or "));
}

std::string sentence_for(const Report& report, const std::vector<Cause>& causes,
                         const JointLine& line) {
  std::string text = findings_words(causes, line.joint);
  const bool looked = std::any_of(report.looked_at.begin(), report.looked_at.end(),
                                  [&](const LookedAt& l) { return l.joint == line.joint; });
  if (text.empty()) {
    text = looked ? "no physics is missing" : "these recordings do not show this joint";
  }
  if (line.figure != nullptr)
    text += "; " + change_words(*line.figure, are_of_fitted_rows(report)) +
            kept_out_words(report, line.joint);
  return capitalised(text) + ".";
}

}  // namespace

std::vector<ChainCell> chain_of(const Report& report, const std::vector<Cause>& causes) {
  std::vector<ChainCell> cells;
  for (const std::string& joint : joints_of(report)) {
    for (const std::string_view stage : kChain)
      cells.push_back(cell_of(report, causes, joint, stage));
  }
  return cells;
}

std::vector<JointLine> joint_lines(const Report& report, const std::vector<Cause>& causes) {
  std::vector<JointLine> lines;
  for (const std::string& joint : joints_of(report)) {
    JointLine line{joint, {}, figure_of_joint(report, joint)};
    line.sentence = sentence_for(report, causes, line);
    lines.push_back(std::move(line));
  }
  return lines;
}

std::string headline(const Verdict& verdict) {
  constexpr std::array<Words, 6> kHeadlines = {
      {{"nothing_left_out", "Nothing is left out that these recordings can show."},
       {"named", "The simulation lacks physics, and these recordings name it."},
       {"ambiguous",
        "The simulation lacks physics, and these recordings allow more than one name for it."},
       {"parameter_out_of_tolerance", "A number of the plant is beyond its tolerance."},
       {"unexplained", "Something real is left out that has no name."},
       {"not_testable", "These recordings cannot tell: they lack the signals or the motion."}}};
  const auto it = std::find_if(kHeadlines.begin(), kHeadlines.end(),
                               [&](const Words& w) { return w.first == verdict.kind; });
  return it == kHeadlines.end() ? verdict.kind : std::string(it->second);
}

}  // namespace ravencal::diagnose
