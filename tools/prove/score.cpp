// SPDX-License-Identifier: Apache-2.0
#include "prove/score.hpp"

#include <algorithm>
#include <cmath>

#include "prove/generator/subject.hpp"
#include "prove/json_fields.hpp"
#include "prove/statistics.hpp"

namespace ravencal::prove {
namespace {

/// What a report calls physics without a name in the vocabulary.
constexpr std::string_view kUnknown = "unknown";

std::vector<Name> names_in(const Json& report) {
  const std::string kind = report.contains("verdict") ? text(report["verdict"], "kind") : "";
  std::vector<Name> names;
  for (const Json& e : list(report, "effects")) {
    Name name{text(e, "id"), text(e, "joint"), text(e, "stage")};
    for (const Json& other : list(e, "ambiguous_with"))
      if (other.is_string()) name.ambiguous_with.push_back(other.get<std::string>());
    // A report without the key still says it by its verdict: physics would have been that.
    name.parameter = e.value("out_of_tolerance", kind == "parameter_out_of_tolerance");
    const Json evidence = e.value("evidence", Json::object());
    const double before = number(evidence, "held_out_before"),
                 after = number(evidence, "held_out_after");
    name.gain = before > 0.0 ? 1.0 - after * after / (before * before) : 0.0;
    if (e.contains("probability")) name.probability = number(e, "probability");
    names.push_back(std::move(name));
  }
  return names;
}

bool is_unknown(const Name& name) { return name.id == kUnknown; }
bool is_physics(const Name& name) { return !name.parameter && !is_unknown(name); }

bool right_joint(const Json& subject, const std::string& joint) {
  const SubjectKind* kind = kind_of(text(subject, "id"));
  return joint == text(subject, "joint") || (kind != nullptr && kind->is(kEverywhere));
}

const Json* effect_of(const Json& report, const Json& subject) {
  for (const Json& e : list(report, "effects")) {
    if (text(e, "id") == text(subject, "id") && right_joint(subject, text(e, "joint")) &&
        same_source(e, subject))
      return &e;
  }
  return nullptr;
}

void score_parameter(const Json& effect, const Json& subject, SubjectScore& score) {
  const std::string wanted = text(subject, "parameter");
  if (wanted.empty()) return;
  for (const Json& p : list(effect, "parameters")) {
    const double truth = number(subject, "value"), value = number(p, "value", std::nan(""));
    if (text(p, "name") != wanted || truth == 0.0 || !std::isfinite(value)) continue;
    score.parameter_error = std::abs(value - truth) / std::abs(truth);
    const Json& ci = list(p, "ci95");
    if (ci.size() == 2 && ci[0].is_number() && ci[1].is_number())
      score.covered = ci[0].get<double>() <= truth && truth <= ci[1].get<double>();
  }
}

Intervals intervals_of(const Json& array) {
  Intervals out;
  for (const Json& pair : array) {
    if (pair.is_array() && pair.size() == 2 && pair[0].is_number() && pair[1].is_number())
      out.emplace_back(pair[0].get<double>(), pair[1].get<double>());
  }
  return out;
}

/// Intervals of one kind that the joint's mismatches were located in: those of the channel that
/// shows the effect, or of all channels if that one says nothing.
Intervals located(const Json& report, const Json& subject, const char* kind) {
  const std::string own = text(subject, "stage") == "command"      ? "command"
                          : text(subject, "channel") == "position" ? "transmission"
                                                                   : "drive";
  Intervals there, anywhere;
  for (const Json& m : list(report, "mismatch")) {
    if (!right_joint(subject, text(m, "joint"))) continue;
    for (const auto& i : intervals_of(list(m.value("where", Json::object()), kind))) {
      anywhere.push_back(i);
      if (text(m, "stage") == own) there.push_back(i);
    }
  }
  return there.empty() ? anywhere : there;
}

void score_place(const Json& report, const Json& subject, SubjectScore& score) {
  for (const Json& m : list(report, "mismatch")) {
    if (!right_joint(subject, text(m, "joint"))) continue;
    score.joint_hit = true;
    if (text(m, "stage") == score.stage) score.stage_hit = true;
  }
  for (const Json& e : list(report, "effects")) {
    if (!right_joint(subject, text(e, "joint"))) continue;
    score.joint_hit = true;
    if (text(e, "stage") == score.stage) score.stage_hit = true;
  }
  const Intervals time = intervals_of(list(subject, "interval_s"));
  const Intervals position = intervals_of(list(subject, "position"));
  if (!time.empty()) score.overlap = interval_overlap(time, located(report, subject, "interval_s"));
  if (!position.empty())
    score.overlap = interval_overlap(position, located(report, subject, "position"));
}

/// Silent: below the printed limit, of every channel that printed one?
void score_limit(const Json& report, const Json& subject, SubjectScore& score) {
  const std::string wanted = text(subject, "parameter");
  for (const Json& n : list(report, "not_found")) {
    if (text(n, "id") != score.id || text(n, "joint") != score.joint || wanted.empty()) continue;
    const double limit = number(n, "detection_limit");
    const std::string parameter = text(n, "parameter");
    const bool of_all = parameter == "rms";
    if (limit > 0.0 && (of_all || parameter == wanted))
      score.limit_kept = score.limit_kept.value_or(true) &&
                         number(subject, of_all ? "size" : "amplitude") <= limit;
  }
}

/// 1 - (after^2 - floor^2) / (before^2 - floor^2); nothing where little was there to remove.
std::optional<double> removed_share(double before, double after, double floor) {
  const double excess = before * before - floor * floor;
  if (!(before > 0.0) || excess < floor * floor) return std::nullopt;
  return std::min(1.0, 1.0 - (after * after - floor * floor) / excess);
}

/// On the held-out run, in the channel where the effect shows. Positions against the generator's
/// floor; efforts were filtered by the tool, which alone knows its floor then.
std::optional<double> removed_in(const Json& held_out, const Json& manifest, const Json& subject,
                                 std::optional<double> effort_floor) {
  const bool position = text(subject, "channel") == "position";
  const std::string joint = text(subject, "joint_seen");
  for (const Json& h : held_out) {
    if (text(h, "joint") != joint) continue;
    if (text(h, "metric") != (position ? "position_rmse" : "effort_rmse")) continue;
    const double floor =
        position ? number(manifest.at("floors").value(joint, Json::object()), "position")
                 : effort_floor.value_or(number(h, "floor"));
    return removed_share(number(h, "before"), number(h, "after"), floor);
  }
  return std::nullopt;
}

SubjectScore score_subject(const Json& subject, const Json& manifest, const Json& report,
                           const std::vector<Name>& names) {
  SubjectScore score;
  score.id = text(subject, "id");
  score.joint = text(subject, "joint");
  score.stage = text(subject, "stage");
  score.outside = subject.value("outside", false);
  score.testable = subject.value("testable", true);
  score.size_over_floor = number(subject, "size_over_floor");
  score.imitated_by = text(subject, "imitated_by");
  score.own_over_floor = number(subject, "own_over_floor", score.size_over_floor);
  for (const Name& name : names) {
    if (!is_physics(name) || !right_joint(subject, name.joint)) continue;
    score.named = score.named || name.id == score.id;
    const auto& others = name.ambiguous_with;
    score.in_a_set = score.in_a_set || name.id == score.id ||
                     std::find(others.begin(), others.end(), score.id) != others.end();
  }
  score_place(report, subject, score);
  for (const Json& u : list(report, "unexplained"))
    score.flagged_here = score.flagged_here || right_joint(subject, text(u, "joint"));
  if (const Json* effect = effect_of(report, subject); effect != nullptr && score.named)
    score_parameter(*effect, subject, score);
  if (!score.in_a_set) score_limit(report, subject, score);
  score.removed = removed_in(list(report, "held_out"), manifest, subject, std::nullopt);
  return score;
}

void score_names(const Json& subjects, CaseScore& score) {
  const Name* strongest = nullptr;
  int right = 0;
  for (const Name& name : score.names) {
    if (!is_physics(name)) continue;
    ++score.physics_names;
    if (strongest == nullptr || name.gain > strongest->gain) strongest = &name;
  }
  for (Name& name : score.names) {
    name.hidden = std::any_of(subjects.begin(), subjects.end(), [&](const Json& s) {
      return text(s, "id") == name.id && right_joint(s, name.joint);
    });
    const auto& others = name.ambiguous_with;
    name.look_alike = std::any_of(subjects.begin(), subjects.end(), [&](const Json& s) {
      return right_joint(s, name.joint) &&
             std::find(others.begin(), others.end(), text(s, "id")) != others.end();
    });
  }
  for (const SubjectScore& s : score.subjects) right += s.named ? 1 : 0;
  score.physics = strongest != nullptr;
  const bool parameter = std::any_of(score.names.begin(), score.names.end(),
                                     [](const Name& n) { return n.parameter; });
  score.top1_id = strongest != nullptr ? strongest->id
                  : score.flagged      ? std::string(kUnknown)
                  : parameter          ? "parameter"
                                       : "silent";
  score.exact = right == static_cast<int>(subjects.size()) && right == score.physics_names;
  if (strongest == nullptr) return;
  score.set_size = 1 + static_cast<int>(strongest->ambiguous_with.size());
  for (const Json& s : subjects)
    score.top1 = score.top1 || (strongest->id == text(s, "id") && right_joint(s, strongest->joint));
}

std::vector<BaselineScore> score_baselines(const Json& verdict, const Json& manifest,
                                           const Json& report) {
  std::vector<BaselineScore> scores;
  const Json& subjects = list(manifest, "subjects");
  const Json baselines = verdict.value("baselines", Json::object());
  for (const auto& [method, said] : baselines.items()) {
    BaselineScore score;
    score.method = method;
    score.names = said.contains("named") && said["named"].is_array();
    for (const Json& name : list(said, "named")) {
      ++score.named;
      for (const Json& s : subjects)
        if (text(s, "id") == text(name, "id") && right_joint(s, text(name, "joint"))) ++score.right;
    }
    if (!subjects.empty()) {
      const std::string joint = text(subjects[0], "joint_seen");
      std::optional<double> floor;
      for (const Json& h : list(report, "held_out"))
        if (text(h, "joint") == joint && text(h, "metric") == "effort_rmse")
          floor = number(h, "floor");
      score.removed = removed_in(list(said, "held_out"), manifest, subjects[0], floor);
    }
    scores.push_back(std::move(score));
  }
  return scores;
}

}  // namespace

core::Result<CaseScore> score_case(const OpenedCase& opened) {
  const Json manifest = Json::parse(opened.manifest, nullptr, false);
  const Json verdict = Json::parse(opened.verdict, nullptr, false);
  if (!manifest.is_object() || !verdict.is_object()) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("case {}: manifest or verdict is not a JSON object", opened.number)};
  }
  CaseScore score;
  score.number = opened.number;
  score.kind = text(manifest, "kind");
  score.track = manifest.value("track", "synthetic");
  score.robot = text(manifest, "robot");
  score.world = text(manifest, "engine");
  score.laws = manifest.value("world", "own");  // without the key there was one world
  if (score.world.empty()) score.world = "recorded";
  score.motion = text(manifest, "motion");
  score.excited = manifest.value("excited", true);
  score.generate_s = number(manifest, "generate_s");
  score.diagnose_s = number(verdict, "cpu_s");
  score.failed = !verdict.contains("report") || !verdict["report"].is_object();
  const Json report = score.failed ? Json::object() : verdict["report"];
  if (report.contains("verdict")) {
    score.verdict = text(report["verdict"], "kind");
    score.text = text(report["verdict"], "text");
  }
  if (score.failed) score.text = text(verdict, "log");
  score.names = names_in(report);
  score.alarm = score.verdict != "nothing_left_out" && score.verdict != "not_testable";
  score.flagged = score.verdict == "unexplained" || !list(report, "unexplained").empty() ||
                  std::any_of(score.names.begin(), score.names.end(), is_unknown);
  const Json& subjects = list(manifest, "subjects");
  for (const Json& subject : subjects)
    score.subjects.push_back(score_subject(subject, manifest, report, score.names));
  score_names(subjects, score);
  if (const Json off = manifest.value("parameter_off", Json()); off.is_object()) {
    for (const Name& name : score.names) {
      score.parameter_found =
          score.parameter_found ||
          (name.parameter && name.id == text(off, "id") && name.joint == text(off, "joint"));
    }
  }
  score.baselines = score_baselines(verdict, manifest, report);
  return score;
}

}  // namespace ravencal::prove
