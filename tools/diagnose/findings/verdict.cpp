// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/verdict.hpp"

#include "core/units.hpp"
#include "diagnose/findings/experiments.hpp"
#include "diagnose/findings/figures.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/words.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace ravencal::diagnose {
namespace {

std::string sentence_of(const NamedEffect& effect) {
  std::string text =
      fmt::format("Joint {}, {}: {}", effect.joint, effect.stage, words_of(effect.id));
  if (!effect.from.empty()) text += " from " + effect.from;
  if (effect.out_of_tolerance) text += " is out of the plant's tolerance";
  if (!effect.parameters.empty()) {
    const NamedParameter& p = effect.parameters.front();
    text +=
        fmt::format(" ({} {}, 95 % between {} and {})", words_of(p.name), quantity(p.value, p.unit),
                    quantity(p.ci95.first, p.unit), quantity(p.ci95.second, p.unit));
  }
  text +=
      fmt::format("; the improved plant's error {} is {} without it and {} with it",
                  rows_words(effect.of_fitted_rows), quantity(effect.held_out_before, effect.unit),
                  quantity(effect.held_out_after, effect.unit));
  if (effect.beyond_plants)
    text +=
        ", and no plant can hold it, so that its error stays in the figures of the improved plant";
  if (!effect.ambiguous_with.empty()) {
    std::vector<std::string> rivals;
    for (const std::string& rival : effect.ambiguous_with) rivals.push_back(words_of(rival));
    text +=
        fmt::format("; not told apart from {}: {}", fmt::join(rivals, ", "), effect.separate_by);
  }
  return text + ".";
}

std::string sentence_of(const Unexplained& u) {
  return fmt::format("Joint {}, {}: {} of the excess ({}) has no name{}{}.", u.joint, u.stage,
                     u.share_of_excess < 0.01 ? std::string("less than 1 %")
                                              : fmt::format("{:.0f} %", 100.0 * u.share_of_excess),
                     quantity(u.size, u.unit), u.depends_on.empty() ? "" : "; it depends on ",
                     fmt::format("{}", fmt::join(u.depends_on, ", ")));
}

/// An error above its floor has no name where nothing else is said of its channel.
void add_unexplained(Report& report) {
  for (const ErrorLeft& e : report.left) {
    if (e.reached || at_place_of(e, report.unexplained) || at_place_of(e, report.effects)) continue;
    report.unexplained.push_back({e.joint,
                                  e.stage,
                                  std::min(1.0, e.share()),
                                  std::sqrt(std::max(0.0, e.left * e.left - e.floor * e.floor)),
                                  e.unit,
                                  {}});
  }
}

/// Where something real was found and nothing named, the schema's `unknown` says so.
void add_unknown(Report& report) {
  const bool fitted = are_of_fitted_rows(report);
  for (const Unexplained& u : report.unexplained) {
    if (at_place_of(u, report.effects)) continue;
    NamedEffect effect;
    effect.id = kUnknown;
    effect.joint = u.joint;
    effect.stage = u.stage;
    effect.unit = u.unit;
    effect.size = u.size;
    effect.p_value = std::numeric_limits<double>::quiet_NaN();  // a floor has no chance
    effect.separate_by =
        experiment_over(u.depends_on.empty() ? "" : u.depends_on.front()).experiment;
    effect.of_fitted_rows = fitted;
    const Mismatch* m = at_place_of(u, report.mismatch);
    if (m != nullptr) effect.p_value = m->p_value;
    // Nothing was added that could take it away: the channel's own figure.
    if (const HeldOut* figure = figure_of_stage(report, u.joint, u.stage)) {
      effect.held_out_before = figure->before;
      effect.held_out_after = figure->after;
    } else if (m != nullptr) {
      effect.held_out_before = effect.held_out_after = std::hypot(m->excess_rmse, m->floor);
    }
    report.effects.push_back(std::move(effect));
  }
}

/// RMS that an effect takes off, or that has no name.
double excess_of(const NamedEffect& effect) {
  const double before = effect.held_out_before, after = effect.held_out_after;
  if (effect.id == kUnknown) return effect.size;
  return std::sqrt(std::max(0.0, before * before - after * after));
}

/// Of an effect that nothing located.
Mismatch mismatch_of(const Report& report, const NamedEffect& effect) {
  Mismatch m;
  m.joint = effect.joint;
  m.stage = effect.stage;
  m.regime = {"everywhere"};
  m.floor = effect.held_out_after;
  const ErrorLeft* left = at_place_of(effect, report.left);
  if (effect.id == kUnknown && left != nullptr) m.floor = left->floor;
  m.unit = effect.unit;
  m.p_value = std::numeric_limits<double>::quiet_NaN();
  return m;
}

/// Recording and plant differ where something is named or has no name, and nowhere else: the gates
/// of names and of the alarm decide, and `mismatch` says where and by how much.
void agree_on_mismatch(Report& report) {
  std::erase_if(report.mismatch,
                [&](const Mismatch& m) { return !at_place_of(m, report.effects); });
  for (const NamedEffect& effect : report.effects) {
    Mismatch* m = at_place_of(effect, report.mismatch);
    if (m == nullptr) m = &report.mismatch.emplace_back(mismatch_of(report, effect));
    m->excess_rmse = std::max(m->excess_rmse, excess_of(effect));
    m->p_value = std::fmin(m->p_value, effect.p_value);
  }
}

/// Of few placebo recordings a share in percent would say more than they know.
std::string alarms_sentence(const Verdict& verdict) {
  return fmt::format(
      "Placebo recordings have the motion of this one, and the plant lacks nothing of them: "
      "something was named in {:.0f} of {}.",
      verdict.false_alarm_rate.value_or(0.0) * verdict.placebos, verdict.placebos);
}

std::string share_words(double share) {
  return share < 0.01 ? std::string("less than 1 %") : fmt::format("{:.3g} %", 100.0 * share);
}

/// Of each channel whose error is above its floor.
std::string left_sentences(const Report& report) {
  std::string text;
  for (const ErrorLeft& e : report.left) {
    if (e.reached) continue;
    text += fmt::format(
        "{}Joint {}, {}: {} of the squared error is left{}: {} where {} {}.",
        text.empty() ? "" : " ", e.joint, e.stage, share_words(e.share()),
        at_place_of(e, report.effects) ? " beside what is named" : " and has no name",
        quantity(e.left, e.unit),
        e.measured_by == "repetition" ? "repetition gives at most" : "the sensors resolve",
        quantity(e.floor, e.unit));
  }
  return text;
}

/// By what floors the channels were judged, and where that says little.
std::string grounds_sentence(const Report& report) {
  const auto repeated =
      std::count_if(report.left.begin(), report.left.end(),
                    [](const ErrorLeft& e) { return e.measured_by == "repetition"; });
  std::string text;
  if (repeated > 0)
    text = fmt::format(" Passes in the same circumstances judged {} of {} channels.", repeated,
                       report.left.size());
  for (const ErrorLeft& e : report.left) {
    if (e.measured_by == "resolution") {
      text += fmt::format(
          " Joint {}, {} does not repeat itself: {} of the squared error is above what the sensors "
          "resolve, and may be slow noise.",
          e.joint, e.stage, share_words(e.share()));
    } else if (e.measured_by == "none") {
      text += fmt::format(" Joint {}, {} has no floor to be judged by.", e.joint, e.stage);
    }
  }
  return text;
}

/// Why silence proves nothing: channels of which most is left, which no other pass showed to be
/// noise, or of which no row was judged. A law is no physics, and has no floor.
std::string doubts_of(const Report& report) {
  std::string text;
  for (const ErrorLeft& e : report.left) {
    if (e.of_signal <= kMostOfSignal || e.measured_by == "repetition") continue;
    text += fmt::format(
        " Joint {}, {}: {} of the squared signal is left, so that what it might lack is not told "
        "from noise: repeat the motion, larger and with more load.",
        e.joint, e.stage, share_words(e.of_signal));
  }
  for (const LookedAt& l : report.looked_at) {
    if (l.stage == "command" || at_place_of(l, report.left)) continue;
    text += fmt::format(
        " Joint {}, {}: the motor stood or turned at every row, so that nothing says how much may "
        "be "
        "left: record it in motion.",
        l.joint, l.stage);
  }
  return text;
}

/// Of each channel whose power mostly lies where nothing is compared.
std::string above_band_sentences(const Report& report) {
  std::string text;
  for (const LookedAt& l : report.looked_at) {
    if (l.above_band <= kMostOfSignal) continue;
    text += fmt::format(
        " Joint {}, {}: {} of the effort's power lies above {:.2g} Hz, where nothing is compared: "
        "pass the same range so slowly that it stays below, or step and hold.",
        l.joint, l.stage, share_words(l.above_band), l.band_hz.second);
  }
  return text;
}

std::string kind_of(const Report& report) {
  bool physics = false, certain = false, parameter = false;
  for (const NamedEffect& effect : report.effects) {
    if (effect.id == kUnknown) continue;
    parameter = parameter || effect.out_of_tolerance;
    physics = physics || !effect.out_of_tolerance;
    certain = certain || (!effect.out_of_tolerance && effect.ambiguous_with.empty());
  }
  if (physics) return certain ? "named" : "ambiguous";
  if (parameter) return "parameter_out_of_tolerance";
  if (!report.unexplained.empty()) return "unexplained";
  const bool looked = !report.held_out.empty() ||
                      std::any_of(report.not_found.begin(), report.not_found.end(),
                                  [](const NotFound& n) { return n.detection_limit.has_value(); });
  const bool proven = doubts_of(report).empty() && above_band_sentences(report).empty();
  return looked && proven ? "nothing_left_out" : "not_testable";
}

}  // namespace

std::string quantity(double value, const std::string& unit) {
  const core::DisplayUnit display = core::display_unit(unit);
  if (display.name != unit) return fmt::format("{:.3g} {}", value * display.per_si, display.name);
  if (unit == "1" || unit.empty()) return fmt::format("{:.3g}", value);
  std::string words = unit;
  for (std::size_t at = words.find("_per_"); at != std::string::npos; at = words.find("_per_"))
    words.replace(at, 5, "/");
  return fmt::format("{:.3g} {}", value, words_of(words));
}

void decide(Report& report) {
  const std::size_t described = report.unexplained.size();
  const std::string left = left_sentences(report);
  add_unexplained(report);
  add_unknown(report);
  agree_on_mismatch(report);
  Verdict& verdict = report.verdict;
  verdict.kind = kind_of(report);
  std::string text;
  if (verdict.kind == "unexplained") {
    text = left;
  } else if (verdict.kind == "nothing_left_out") {
    text =
        "Nothing is left out of the plant that this recording can show. What would have been seen, "
        "and from which size on, stands under what was not found." +
        grounds_sentence(report);
  } else if (verdict.kind == "not_testable") {
    text =
        "This recording cannot tell: it lacks the signals or the motion that would show a "
        "mismatch." +
        doubts_of(report);
  }
  const std::string above = above_band_sentences(report);
  for (const NamedEffect& effect : report.effects) {
    if (effect.id != kUnknown) text += (text.empty() ? "" : " ") + sentence_of(effect);
  }
  if (verdict.kind != "unexplained" && !left.empty()) text += (text.empty() ? "" : " ") + left;
  for (std::size_t i = 0; i < described; ++i)
    text += (text.empty() ? "" : " ") + sentence_of(report.unexplained[i]);
  text += above;
  for (const std::string& note : report.notes) text += " Note: " + note + ".";
  if (verdict.false_alarm_rate) {
    text += " " + alarms_sentence(verdict);
  }
  verdict.text = text;
}

}  // namespace ravencal::diagnose
