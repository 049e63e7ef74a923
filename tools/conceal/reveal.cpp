// SPDX-License-Identifier: Apache-2.0
#include "conceal/reveal.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/units.hpp"

namespace ravencal::conceal {
namespace {

using Json = nlohmann::ordered_json;

std::string text(const Json& json, const char* key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_string() ? it->get<std::string>() : std::string();
}

double number(const Json& json, const char* key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_number() ? it->get<double>() : 0.0;
}

const Json& list(const Json& json, const char* key) {
  static const Json empty = Json::array();
  const auto it = json.find(key);
  return it != json.end() && it->is_array() ? *it : empty;
}

std::vector<std::string> words(const Json& array) {
  std::vector<std::string> out;
  for (const Json& word : array)
    if (word.is_string()) out.push_back(word.get<std::string>());
  return out;
}

/// A report names a coupling's parameter with the joint from which it comes.
bool is_parameter(const std::string& told, const Told& hidden) {
  return told == hidden.parameter || told == hidden.parameter + "_from_" + hidden.from;
}

Told hidden_in(const Json& answer) {
  Told hidden{text(answer, "joint"),
              text(answer, "id"),
              text(answer, "from"),
              text(answer, "drawn"),
              "",
              0.0,
              std::nullopt};
  for (const Json& p : list(answer, "parameters")) {
    if (text(p, "name") != hidden.parameter) continue;
    hidden.value = number(p, "value");
    hidden.unit = text(p, "unit");
  }
  return hidden;
}

/// An entry of the report; its parameter is the one that was drawn, else its first.
Told told_by(const Json& effect, const Told& hidden) {
  Told told{text(effect, "joint"), text(effect, "id"), "", "", "", 0.0, std::nullopt};
  const Json& parameters = list(effect, "parameters");
  const auto same = std::find_if(parameters.begin(), parameters.end(), [&](const Json& p) {
    return is_parameter(text(p, "name"), hidden);
  });
  const auto it = same == parameters.end() ? parameters.begin() : same;
  if (it == parameters.end()) return told;
  told.parameter = text(*it, "name");
  told.value = number(*it, "value");
  told.unit = text(*it, "unit");
  const Json& ci = list(*it, "ci95");
  if (ci.size() == 2 && ci[0].is_number() && ci[1].is_number())
    told.ci95 = {ci[0].get<double>(), ci[1].get<double>()};
  return told;
}

/// How well an entry answers: right, not told apart from what is right, or not at all.
Outcome outcome_of(const Json& effect, const Told& hidden) {
  if (text(effect, "joint") != hidden.joint) return Outcome::kMissed;
  // A coupling is right if it comes from the right joint.
  const Told told = told_by(effect, hidden);
  const bool same_source = hidden.from.empty() || is_parameter(told.parameter, hidden);
  if (text(effect, "id") == hidden.id && same_source) return Outcome::kFound;
  const std::vector<std::string> others = words(list(effect, "ambiguous_with"));
  const bool among = std::find(others.begin(), others.end(), hidden.id) != others.end();
  return among ? Outcome::kLookAlike : Outcome::kMissed;
}

HeldOutError error_of(const Json& effect) {
  const Json evidence = effect.value("evidence", Json::object());
  return {number(evidence, "held_out_before"), number(evidence, "held_out_after"),
          text(evidence, "unit")};
}

/// Of the joint, where the effect shows; nothing if the report has no such figure.
std::optional<HeldOutError> error_of_joint(const Json& report, const Revealed& revealed) {
  for (const Json& h : list(report, "held_out")) {
    if (text(h, "joint") == revealed.hidden.joint &&
        text(h, "metric") == revealed.shows_in + "_rmse")
      return HeldOutError{number(h, "before"), number(h, "after"), text(h, "unit")};
  }
  return std::nullopt;
}

/// For people: degrees and millimetres.
std::pair<double, std::string> shown(double value, const std::string& unit) {
  const core::DisplayUnit display = core::display_unit(unit);
  return {value * display.per_si, unit == "1" ? "" : display.name};
}

std::string value_text(const Told& told) {
  if (told.parameter.empty()) return "";
  const auto [value, unit] = shown(told.value, told.unit);
  std::string out = fmt::format("{} {:.4g}", told.parameter, value);
  if (told.ci95)
    out += fmt::format(" [{:.4g}, {:.4g}]", shown(told.ci95->first, told.unit).first,
                       shown(told.ci95->second, told.unit).first);
  return unit.empty() ? out : out + " " + unit;
}

std::string error_text(const HeldOutError& error) {
  const auto [before, unit] = shown(error.before, error.unit);
  return fmt::format("{:.4g} -> {:.4g} {}", before, shown(error.after, error.unit).first, unit);
}

std::string judgement(const Revealed& r) {
  std::string out;
  const bool is_named = r.outcome == Outcome::kFound || r.outcome == Outcome::kFoundBeside;
  if (r.outcome == Outcome::kFound) out = "found: joint and effect are right";
  if (r.outcome == Outcome::kFoundBeside)
    out = "found beside false names: one effect was hidden, which is no hit";
  if (r.outcome == Outcome::kLookAlike)
    out = fmt::format("look-alike: the report does not tell {} apart from {}; that is no hit",
                      r.found->id, r.hidden.id);
  if (r.outcome == Outcome::kMissed) out = "missed: the report does not name it at that joint";
  if (is_named && !r.not_told_apart.empty())
    out += fmt::format("; not told apart from {}", fmt::join(r.not_told_apart, ", "));
  for (const auto& [joint, id] : r.also_named)
    out += fmt::format("; also named: {} at the {}", id, joint);
  return out;
}

Json json_of(const Told& told) {
  Json json = {{"joint", told.joint},
               {"id", told.id},
               {"parameter", told.parameter},
               {"value", told.value},
               {"unit", told.unit}};
  if (told.ci95) json["ci95"] = {told.ci95->first, told.ci95->second};
  return json;
}

}  // namespace

std::string_view word_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::kFound:
      return "found";
    case Outcome::kFoundBeside:
      return "found_beside_false_names";
    case Outcome::kLookAlike:
      return "look_alike";
    case Outcome::kMissed:
      break;
  }
  return "missed";
}

core::Result<Revealed> reveal(const std::string& answer_text, const std::string& report_text) {
  const Json answer = Json::parse(answer_text, nullptr, false);
  const Json report = Json::parse(report_text, nullptr, false);
  if (!answer.is_object() || text(answer, "id").empty())
    return core::Error{core::ErrorCode::kData, "the answer is none of `ravencal conceal`"};
  if (!report.is_object() || !report.contains("verdict"))
    return core::Error{core::ErrorCode::kData, "the report is none of `ravencal diagnose`"};
  Revealed revealed;
  revealed.hidden = hidden_in(answer);
  revealed.scatters = number(answer, "scatters");
  revealed.shows_in = text(answer, "shows_in");
  revealed.verdict = text(report["verdict"], "kind");
  const Json* best = nullptr;
  for (const Json& effect : list(report, "effects")) {
    const Outcome outcome = outcome_of(effect, revealed.hidden);
    if (outcome >= revealed.outcome) continue;
    revealed.outcome = outcome;
    best = &effect;
  }
  for (const Json& effect : list(report, "effects")) {
    if (&effect != best)
      revealed.also_named.emplace_back(text(effect, "joint"), text(effect, "id"));
  }
  if (best == nullptr) {
    revealed.error = error_of_joint(report, revealed);
    return revealed;
  }
  if (revealed.outcome == Outcome::kFound && !revealed.also_named.empty())
    revealed.outcome = Outcome::kFoundBeside;
  revealed.found = told_by(*best, revealed.hidden);
  revealed.error = error_of(*best);
  revealed.not_told_apart = words(list(*best, "ambiguous_with"));
  return revealed;
}

std::string reveal_table(const Revealed& r) {
  constexpr const char* kRow = "{:<8} {:<10} {:<24} {:<52} {}\n";
  const Told nothing{"-", "-", "", "", "", 0.0, std::nullopt};
  const Told& found = r.found ? *r.found : nothing;
  std::string out = fmt::format(kRow, "", "joint", "effect", "size", "held-out error");
  out += fmt::format(kRow, "hidden", r.hidden.joint, r.hidden.id, value_text(r.hidden),
                     fmt::format("{:.1f} times the scatter of two runs", r.scatters));
  out += fmt::format(kRow, "found", found.joint, found.id, value_text(found),
                     r.error ? error_text(*r.error) : "-");
  return out + judgement(r) + "\n";
}

std::string reveal_json(const Revealed& r) {
  Json json = {{"outcome", word_of(r.outcome)}, {"verdict", r.verdict},
               {"scatters", r.scatters},        {"shows_in", r.shows_in},
               {"hidden", json_of(r.hidden)},   {"found", nullptr},
               {"held_out", nullptr},           {"not_told_apart", r.not_told_apart},
               {"also_named", Json::array()}};
  if (r.found) json["found"] = json_of(*r.found);
  if (r.error)
    json["held_out"] = {
        {"before", r.error->before}, {"after", r.error->after}, {"unit", r.error->unit}};
  for (const auto& [joint, id] : r.also_named)
    json["also_named"].push_back({{"joint", joint}, {"id", id}});
  return json.dump(1) + "\n";
}

}  // namespace ravencal::conceal
