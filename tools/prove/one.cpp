// SPDX-License-Identifier: Apache-2.0
#include "prove/one.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/units.hpp"
#include "core/words_of.hpp"
#include "prove/json_fields.hpp"
#include "prove/score.hpp"

namespace ravencal::prove {
namespace {

Json size_of(const Json& effect, const std::string& parameter) {
  for (const Json& p : list(effect, "parameters")) {
    if (!parameter.empty() && text(p, "name") != parameter) continue;
    return {{"parameter", text(p, "name")},
            {"value", p.value("value", Json())},
            {"unit", text(p, "unit")},
            {"ci95", p.value("ci95", Json())}};
  }
  return nullptr;
}

/// Of what was found; else of the joint and channel that show what was hidden.
Json held_out_of(const Json& report, const Json& subject, const Json* effect) {
  if (effect != nullptr) {
    const Json evidence = effect->value("evidence", Json::object());
    if (!text(evidence, "unit").empty())
      return {{"before", evidence.value("held_out_before", Json())},
              {"after", evidence.value("held_out_after", Json())},
              {"unit", text(evidence, "unit")}};
  }
  for (const Json& h : list(report, "held_out")) {
    if (text(h, "joint") == text(subject, "joint_seen") &&
        text(h, "metric") == text(subject, "channel") + "_rmse")
      return {{"before", h.value("before", Json())},
              {"after", h.value("after", Json())},
              {"unit", text(h, "unit")}};
  }
  return nullptr;
}

/// For people: degrees and millimetres.
std::string amount(const Json& value, const std::string& unit) {
  return value.is_number()
             ? fmt::format("{:.4g}", value.get<double>() * core::display_unit(unit).per_si)
             : "?";
}

std::string unit_text(const std::string& unit) {
  return unit.empty() || unit == "1" ? "" : " " + core::display_unit(unit).name;
}

std::string found_size(const Json& size) {
  if (!size.is_object()) return "";
  const std::string unit = text(size, "unit");
  std::string out = fmt::format("{} {}", text(size, "parameter"), amount(size["value"], unit));
  if (size["ci95"].is_array() && size["ci95"].size() == 2)
    out += fmt::format(" [{}, {}]", amount(size["ci95"][0], unit), amount(size["ci95"][1], unit));
  return out + unit_text(unit);
}

/// In the unit of what was found, where that is the same number; else in SI units.
std::string hidden_size(const Json& hidden, const Json& found) {
  if (text(hidden, "parameter").empty()) return "";
  const bool same = found.is_object() && text(found, "parameter") == text(hidden, "parameter");
  const std::string unit = same ? text(found, "unit") : "";
  return fmt::format("{} {}{}", text(hidden, "parameter"), amount(hidden["value"], unit),
                     same ? unit_text(unit) : " (SI)");
}

std::string judgement(const Json& one) {
  const std::string outcome = text(one, "outcome");
  std::string out = "missed: the report does not name it at that joint";
  if (text(one, "verdict").empty()) out = "missed: the diagnosis gave no report";
  if (outcome == "found") out = "found: joint and effect are right";
  if (outcome == "found_beside_false_names")
    out = "found beside false names: one effect was hidden, which is no hit";
  if (outcome == "look_alike")
    out = fmt::format("look-alike: the report does not tell {} apart from {}; that is no hit",
                      core::words_of(text(one["found"], "id")),
                      core::words_of(text(one["hidden"], "id")));
  else if (!one["not_told_apart"].empty())
    out += fmt::format(
        "; not told apart from {}",
        core::words_of(fmt::format(
            "{}", fmt::join(one["not_told_apart"].get<std::vector<std::string>>(), ", "))));
  for (const Json& name : one["also_named"])
    out += fmt::format("; also named: {} at the {}", core::words_of(text(name, "id")),
                       text(name, "joint"));
  return out;
}

}  // namespace

core::Result<Json> one_json(const OpenedCase& opened) {
  RAVENCAL_ASSIGN_OR_RETURN(const CaseScore score, score_case(opened));
  if (score.subjects.size() != 1)
    return core::Error{core::ErrorCode::kData, fmt::format("case {}: hides {} effects and not one",
                                                           opened.number, score.subjects.size())};
  const Json manifest = Json::parse(opened.manifest);
  const Json& subject = manifest["subjects"][0];
  const Json report = score.failed ? Json::object() : Json::parse(opened.verdict)["report"];
  const SubjectScore& hidden = score.subjects.front();
  const auto hits = [&](std::size_t i) {
    const Name& name = score.names[i];
    return name.hidden && !name.parameter && same_source(report["effects"][i], subject);
  };
  const std::size_t count = score.names.size();
  const auto first = [&](const auto& fits) {
    std::size_t i = 0;
    while (i < count && !fits(i)) ++i;
    return i;
  };
  const bool hit = first(hits) < count;
  const std::size_t best =
      hit ? first(hits) : first([&](std::size_t i) { return score.names[i].look_alike; });
  const Name* found = best < count ? &score.names[best] : nullptr;
  const Json* effect = found != nullptr ? &report["effects"][best] : nullptr;
  Json also = Json::array();
  for (std::size_t i = 0; i < count; ++i)
    if (i != best && !hits(i))
      also.push_back({{"joint", score.names[i].joint}, {"id", score.names[i].id}});
  const char* const outcome = found == nullptr ? "missed"
                              : !hit           ? "look_alike"
                              : also.empty()   ? "found"
                                               : "found_beside_false_names";
  Json one = {{"schema", 1},
              {"outcome", outcome},
              {"verdict", score.verdict},
              {"world", score.laws},
              {"hidden",
               {{"joint", hidden.joint},
                {"id", hidden.id},
                {"from", text(subject, "from")},
                {"parameter", text(subject, "parameter")},
                {"value", subject.value("value", Json())},
                {"channel", text(subject, "channel")},
                {"size_over_floor", hidden.size_over_floor},
                {"imitated_by", hidden.imitated_by},
                {"own_over_floor", hidden.own_over_floor}}},
              {"found", nullptr},
              {"held_out", held_out_of(report, subject, effect)},
              {"not_told_apart", Json::array()},
              {"also_named", std::move(also)}};
  if (found != nullptr) {
    one["found"] = {{"joint", found->joint},
                    {"id", found->id},
                    {"size", size_of(*effect, hit ? text(subject, "parameter") : "")}};
    one["not_told_apart"] = found->ambiguous_with;
  }
  return one;
}

std::string one_text(const Json& one) {
  constexpr const char* kRow = "{:<8} {:<10} {:<24} {:<52} {}\n";
  const Json& hidden = one["hidden"];
  const bool found = one["found"].is_object();
  const Json size = found ? one["found"]["size"] : Json();
  std::string error = "-";
  if (const Json& h = one["held_out"]; h.is_object()) {
    const std::string unit = text(h, "unit");
    error = fmt::format("{} -> {}{}", amount(h["before"], unit), amount(h["after"], unit),
                        unit_text(unit));
  }
  std::string out = fmt::format(kRow, "", "joint", "effect", "size", "held-out error");
  out += fmt::format(kRow, "hidden", text(hidden, "joint"), text(hidden, "id"),
                     hidden_size(hidden, size),
                     fmt::format("{:.1f} times the floor", number(hidden, "size_over_floor")));
  out += fmt::format(kRow, "found", found ? text(one["found"], "joint") : "-",
                     found ? text(one["found"], "id") : "-", found_size(size), error);
  return out + judgement(one) + "\n";
}

}  // namespace ravencal::prove
