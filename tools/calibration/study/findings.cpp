// SPDX-License-Identifier: Apache-2.0
#include "study/findings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "study/ablation_tables.hpp"

namespace ravencal::study {
namespace {

/// "Costs nothing": the RMSE rises by no more than this share. A tenth of what the paper marks.
constexpr double kNothing = 0.03;

RowId without(std::string_view network) { return {std::string(network), std::string(kNoAblation)}; }
RowId spoilt(Noise noise, std::string_view set) {
  return {std::string(kNoAblation), variant_id(noise, set)};
}

bool has_all(const ConditionResults& results, std::initializer_list<RowId> rows) {
  return std::all_of(rows.begin(), rows.end(), [&](const RowId& row) { return results.has(row); });
}

/// A change of the RMSE as a person reads it.
std::string percent(double ratio) { return fmt::format("{:+.0f} %", 100.0 * (ratio - 1.0)); }
std::string percent(const Figure& ratio) {
  return fmt::format("{} [{} to {}]", percent(ratio.mean), percent(ratio.interval.low),
                     percent(ratio.interval.high));
}
std::string points(const Figure& difference) {
  return fmt::format("{:+.0f} points [{:+.0f} to {:+.0f}]", 100.0 * difference.mean,
                     100.0 * difference.interval.low, 100.0 * difference.interval.high);
}

/// Whether a figure lies above (or below) a limit.
Verdict above(const Figure& figure, double limit) {
  if (figure.interval.low > limit) return Verdict::kHolds;
  return figure.interval.high < limit ? Verdict::kDoesNotHold : Verdict::kUndecided;
}
Verdict below(const Figure& figure, double limit) {
  if (figure.interval.high < limit) return Verdict::kHolds;
  return figure.interval.low > limit ? Verdict::kDoesNotHold : Verdict::kUndecided;
}

/// A statement of several parts holds if all do, and fails if one fails.
Verdict both(Verdict a, Verdict b) {
  if (a == Verdict::kDoesNotHold || b == Verdict::kDoesNotHold) return Verdict::kDoesNotHold;
  if (a == Verdict::kUndecided || b == Verdict::kUndecided) return Verdict::kUndecided;
  return Verdict::kHolds;
}

/// The sets of ablated_sets() from `first` up to `last` (ids, inclusive) that the results have.
std::vector<FeatureSet> rivals(const ConditionResults& results, std::string_view first,
                               std::string_view last, std::string_view but) {
  std::vector<FeatureSet> sets;
  bool within = false;
  for (const FeatureSet& set : ablated_sets()) {
    within = within || set.id == first;
    if (within && set.id != but && results.has(without(set.id))) sets.push_back(set);
    if (set.id == last) break;
  }
  return sets;
}

/// `set` raises the RMSE of joints `from` and after by more than each rival does.
void compare_with_rivals(const ConditionResults& results, const std::string& set,
                         const std::vector<FeatureSet>& others, std::size_t from,
                         Finding& finding) {
  const Tested none{RowId{}, {}};
  const Tested row{without(set), {}};
  finding.verdict = Verdict::kHolds;
  finding.evidence = fmt::format("{} without it", percent(results.ratio(row, none, from)));
  for (const FeatureSet& other : others) {
    const Tested rival{without(other.id), {}};
    const Figure difference = results.ratio_difference(row, rival, none, from);
    const Verdict verdict = above(difference, 0.0);
    if (verdict != Verdict::kHolds || &other == &others.back()) {
      finding.evidence +=
          fmt::format("; without {} {}, difference {}", other.title,
                      percent(results.ratio(rival, none, from).mean), points(difference));
    }
    finding.verdict = both(finding.verdict, verdict);
  }
}

Finding poses_matter_most(const ConditionResults& results) {
  Finding finding{"all_poses", "All poses together matter most", results.condition().title,
                  Verdict::kNotTested, ""};
  const auto others = rivals(results, "time_and_state", "torque_and_current", kAllPoses);
  // Joint and motor poses are part of all poses, not their rivals.
  std::vector<FeatureSet> apart;
  for (const FeatureSet& set : others) {
    if (set.id != kMotorSidePoses) apart.push_back(set);
  }
  if (!has_all(results, {RowId{}, without(kAllPoses)}) || apart.empty()) return finding;
  compare_with_rivals(results, std::string(kAllPoses), apart, 0, finding);
  return finding;
}

Finding end_effector_stands_in(const ConditionResults& results) {
  Finding finding{"end_effector_stands_in", "The end-effector pose can stand in for joint poses",
                  results.condition().title, Verdict::kNotTested, ""};
  const RowId motor_side = without(kMotorSidePoses);
  if (!has_all(results, {RowId{}, without("joint_pose"), motor_side, without(kAllPoses)})) {
    return finding;
  }
  const Tested none{RowId{}, {}};
  const Figure joints = results.ratio({without("joint_pose"), {}}, none);
  const Figure side = results.ratio({motor_side, {}}, none);
  const Figure all = results.ratio({without(kAllPoses), {}}, none);
  finding.verdict =
      both(both(below(joints, kMarkedRatio), below(side, kMarkedRatio)), above(all, kMarkedRatio));
  finding.evidence = fmt::format(
      "without joint poses {}; without joint and motor poses {} (the end-effector pose left); "
      "without all poses {}; the limit is +30 %",
      percent(joints), percent(side), percent(all));
  return finding;
}

Finding direction_of_torque(const ConditionResults& results) {
  Finding finding{"torque_direction", "The torques' direction matters more than their amplitude",
                  results.condition().title, Verdict::kNotTested, ""};
  const std::string set = "tau_and_dac";
  const RowId flip = spoilt(Noise::kFlip, set);
  const RowId triple = spoilt(Noise::kTriple, set);
  if (!has_all(results, {RowId{}, flip, triple})) return finding;
  const Tested none{RowId{}, {}};
  const Figure difference = results.ratio_difference({flip, {}}, {triple, {}}, none);
  finding.verdict = above(difference, 0.0);
  finding.evidence = fmt::format("torques and currents × −1 {}; × 3 {}; difference {}",
                                 percent(results.ratio({flip, {}}, none)),
                                 percent(results.ratio({triple, {}}, none)), points(difference));
  return finding;
}

Finding joint_two_carries(const ConditionResults& results) {
  Finding finding{"joint_2", "Joint 2's features carry joints 2 and 3", results.condition().title,
                  Verdict::kNotTested, ""};
  const std::string joint_two = "joint_2";
  const auto others = rivals(results, "joint_1", "joint_7", joint_two);
  if (!has_all(results, {RowId{}, without(joint_two)}) || others.empty() ||
      results.joints().size() < 2) {
    return finding;
  }
  compare_with_rivals(results, joint_two, others, 1, finding);
  return finding;
}

Finding encoders_break(const ConditionResults& results) {
  Finding finding{"homing", "Encoder values break after homing, and dropping them costs nothing",
                  results.condition().title, Verdict::kNotTested, ""};
  const RowId all = without(kAllFeatures);
  const RowId none = without(kNoEncoder);
  const std::size_t tests = results.condition().test.size();
  if (!has_all(results, {all, none}) || tests < 2) return finding;
  const Figure cost = results.ratio({none, 0}, {all, 0});
  finding.verdict = below(cost, 1.0 + kNothing);
  finding.evidence = fmt::format("without encoders {} before homing", percent(cost));
  // Both are of the same run, because runs differ in difficulty, homed or not.
  for (std::size_t i = 1; i < tests; ++i) {
    const Figure harm = results.ratio({all, i}, {none, i});
    finding.verdict = both(finding.verdict, above(harm, kMarkedRatio));
    finding.evidence += fmt::format("; after {}: with them {}", i, percent(harm));
  }
  finding.evidence += ", against the same run without; the limit is +30 %";
  return finding;
}

Finding homings_guide(const ConditionResults& results) {
  Finding finding{"homing_guided", "Trained on several homings, encoder values do no harm",
                  results.condition().title, Verdict::kNotTested, ""};
  const RowId all = without(kAllFeatures);
  const RowId none = without(kNoEncoder);
  if (!has_all(results, {all, none})) return finding;
  finding.verdict = Verdict::kHolds;
  for (std::size_t i = 0; i < results.condition().test.size(); ++i) {
    const Figure harm = results.ratio({all, i}, {none, i});
    finding.verdict = both(finding.verdict, below(harm, kMarkedRatio));
    finding.evidence +=
        fmt::format("{}after {}: all features {}", i == 0 ? "" : "; ", i, percent(harm));
  }
  finding.evidence += ", against no encoder features; the limit is +30 %";
  return finding;
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHolds:
      return "holds";
    case Verdict::kDoesNotHold:
      return "does not hold";
    case Verdict::kUndecided:
      return "undecided";
    case Verdict::kNotTested:
      break;
  }
  return "not tested";
}

std::vector<Finding> findings_of(const Results& results) {
  std::vector<Finding> findings;
  for (const ConditionResults& condition : results.conditions) {
    if (condition.condition().homing) {
      findings.push_back(condition.condition().rehomed ? homings_guide(condition)
                                                       : encoders_break(condition));
      continue;
    }
    findings.push_back(poses_matter_most(condition));
    findings.push_back(end_effector_stands_in(condition));
    findings.push_back(direction_of_torque(condition));
    findings.push_back(joint_two_carries(condition));
  }
  return findings;
}

bool all_hold(std::span<const Finding> findings) {
  return std::all_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.verdict == Verdict::kHolds || finding.verdict == Verdict::kNotTested;
  });
}

std::string findings_text(std::span<const Finding> findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += fmt::format("{:<14} {} ({})\n", name_of(finding.verdict), finding.statement,
                        finding.condition);
    if (!finding.evidence.empty()) text += fmt::format("{:<14} {}\n", "", finding.evidence);
  }
  return text;
}

std::string findings_json(std::span<const Finding> findings) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"id", finding.id},
                    {"statement", finding.statement},
                    {"condition", finding.condition},
                    {"verdict", name_of(finding.verdict)},
                    {"evidence", finding.evidence}});
  }
  return nlohmann::ordered_json{{"schema", 1}, {"findings", std::move(list)}}.dump(2) + "\n";
}

}  // namespace ravencal::study
