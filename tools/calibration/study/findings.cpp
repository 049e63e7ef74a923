// SPDX-License-Identifier: Apache-2.0
#include "study/findings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <utility>

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

/// The sets among `sets` that the results have networks without.
std::vector<FeatureSet> present(const ConditionResults& results, std::span<const FeatureSet> sets,
                                const std::function<bool(const FeatureSet&)>& wanted) {
  std::vector<FeatureSet> found;
  for (const FeatureSet& set : sets) {
    if (wanted(set) && results.has(without(set.id))) found.push_back(set);
  }
  return found;
}

/// `set` raises the RMSE of these joints by more than each rival does.
void compare_with_rivals(const ConditionResults& results, std::string_view set,
                         const std::vector<FeatureSet>& others, JointRange joints,
                         Finding& finding) {
  const Tested none{RowId{}, {}};
  const Tested row{without(set), {}};
  if (!has_all(results, {RowId{}, row.row}) || others.empty()) return;
  finding.verdict = Verdict::kHolds;
  finding.evidence = fmt::format("{} without it", percent(results.ratio(row, none, joints)));
  for (const FeatureSet& other : others) {
    const Tested rival{without(other.id), {}};
    const Figure difference = results.ratio_difference(row, rival, none, joints);
    const Verdict verdict = above(difference, 0.0);
    if (verdict != Verdict::kHolds || &other == &others.back()) {
      finding.evidence +=
          fmt::format("; without {} {}, difference {}", other.title,
                      percent(results.ratio(rival, none, joints).mean), points(difference));
    }
    finding.verdict = both(finding.verdict, verdict);
  }
}

/// `row` raises the RMSE of these joints by more than `other` does.
void compare_rows(const ConditionResults& results, const std::pair<std::string, RowId>& row,
                  const std::pair<std::string, RowId>& other, JointRange joints, Finding& finding) {
  if (!has_all(results, {RowId{}, row.second, other.second})) return;
  const Tested none{RowId{}, {}};
  const Tested a{row.second, {}};
  const Tested b{other.second, {}};
  const Figure difference = results.ratio_difference(a, b, none, joints);
  finding.verdict = above(difference, 0.0);
  finding.evidence =
      fmt::format("{} {}; {} {}; difference {}", row.first, percent(results.ratio(a, none, joints)),
                  other.first, percent(results.ratio(b, none, joints)), points(difference));
}

/// Whether each of these joints keeps below (or goes above) the paper's mark without the features
/// of joint `left_out`.
void check_joints(const ConditionResults& results, int left_out, JointRange joints,
                  bool spoilt_without, Finding& finding) {
  const Tested none{RowId{}, {}};
  for (std::size_t joint = joints.first; joint < joints.end; ++joint) {
    const Figure rise = results.ratio({without(joint_set(left_out)), {}}, none, {joint, joint + 1});
    finding.verdict = both(finding.verdict,
                           spoilt_without ? above(rise, kMarkedRatio) : below(rise, kMarkedRatio));
    finding.evidence +=
        fmt::format("{}{} without joint {} {}", finding.evidence.empty() ? "" : "; ",
                    results.joints()[joint].name, left_out, percent(rise));
  }
}

Finding begun(const ConditionResults& results, const char* id, const char* statement) {
  return {id, statement, results.condition().title, Verdict::kNotTested, ""};
}

Finding poses_matter_most(const ConditionResults& results) {
  Finding finding = begun(results, "all_poses", "All poses together matter most");
  const auto others = present(results, grouped_sets(), [](const FeatureSet& set) {
    return set.id != kAllPoses && set.id != kJointPoses && set.id != kEndEffector;  // its parts
  });
  compare_with_rivals(results, kAllPoses, others, results.all_joints(), finding);
  return finding;
}

Finding end_effector_stands_in(const ConditionResults& results) {
  Finding finding = begun(results, "end_effector_stands_in",
                          "The end-effector pose can stand in for joint poses");
  if (!has_all(results, {RowId{}, without(kJointPoses), without(kAllPoses)})) return finding;
  const Tested none{RowId{}, {}};
  const Figure side = results.ratio({without(kJointPoses), {}}, none, results.all_joints());
  const Figure all = results.ratio({without(kAllPoses), {}}, none, results.all_joints());
  finding.verdict = both(below(side, kMarkedRatio), above(all, kMarkedRatio));
  finding.evidence = fmt::format(
      "without joint and motor poses {} (the end-effector pose left); without all poses {}; the "
      "limit is +30 %",
      percent(side), percent(all));
  return finding;
}

Finding direction_of_torque(const ConditionResults& results) {
  Finding finding = begun(results, "torque_direction",
                          "The torques' direction matters more than their amplitude");
  compare_rows(results, {"torques and currents × −1", spoilt(Noise::kFlip, kTorques)},
               {"× 3", spoilt(Noise::kTriple, kTorques)}, results.all_joints(), finding);
  return finding;
}

/// The paper says this of the inputs; its figures are of the released code.
Finding inaccurate_poses_worse(const ConditionResults& results, NoiseInto into) {
  const bool released = into == NoiseInto::kBelievedAsWell;
  Finding finding = begun(
      results, released ? "inaccurate_poses_released" : "inaccurate_poses",
      released ? "Inaccurate joint poses hurt joints 1 and 2 more than missing ones: as released"
               : "Inaccurate joint poses hurt joints 1 and 2 more than missing ones: inputs alone");
  if (results.joints().size() < 2) return finding;
  const RowId inaccurate = {
      std::string(kNoAblation),
      released ? released_id(kJointPoses) : variant_id(Noise::kDeviation, kJointPoses)};
  compare_rows(results, {"inaccurate", inaccurate}, {"missing", without(kJointPoses)}, {0, 2},
               finding);
  return finding;
}

Finding missing_torque_worse(const ConditionResults& results) {
  Finding finding =
      begun(results, "missing_torque", "Missing torques hurt more than inaccurate ones");
  compare_rows(results, {"missing", without(kTorques)},
               {"inaccurate", spoilt(Noise::kDeviation, kTorques)}, results.all_joints(), finding);
  return finding;
}

Finding joint_three_needs_torque(const ConditionResults& results) {
  Finding finding =
      begun(results, "torque_joint_3", "Joint 3 loses most of all groups without the torques");
  if (results.joints().size() < 3) return finding;
  const auto others =
      present(results, grouped_sets(), [](const FeatureSet& set) { return set.id != kTorques; });
  compare_with_rivals(results, kTorques, others, {2, 3}, finding);
  return finding;
}

Finding joint_two_carries(const ConditionResults& results) {
  Finding finding = begun(results, "joint_2", "Joint 2's features carry joints 2 and 3");
  const auto others = present(results, ablated_sets(), [](const FeatureSet& set) {
    return is_joint_set(set) && set.id != joint_set(2);
  });
  if (results.joints().size() < 2) return finding;
  compare_with_rivals(results, joint_set(2), others, {1, results.joints().size()}, finding);
  return finding;
}

Finding joint_two_spoils(const ConditionResults& results) {
  Finding finding = begun(results, "joint_2_spoils",
                          "Without joint 2's features joints 2 and 3 are spoilt, joint 1 is not");
  if (!has_all(results, {RowId{}, without(joint_set(2))}) || results.joints().size() != 3)
    return finding;
  finding.verdict = Verdict::kHolds;
  check_joints(results, 2, {0, 1}, false, finding);
  check_joints(results, 2, {1, 3}, true, finding);
  finding.evidence += "; the limit is +30 %";
  return finding;
}

Finding joints_one_and_three_are_free(const ConditionResults& results) {
  Finding finding = begun(results, "joints_1_and_3",
                          "The features of joint 1, and those of joint 3, can be left out");
  if (!has_all(results, {RowId{}, without(joint_set(1)), without(joint_set(3))})) return finding;
  finding.verdict = Verdict::kHolds;
  check_joints(results, 1, results.all_joints(), false, finding);
  check_joints(results, 3, results.all_joints(), false, finding);
  finding.evidence += "; the limit is +30 %";
  return finding;
}

Finding encoders_break(const ConditionResults& results) {
  Finding finding = begun(results, "homing",
                          "Encoder values break after homing, and dropping them costs nothing");
  const RowId all = without(kAllFeatures);
  const RowId none = without(kNoEncoder);
  const std::size_t tests = results.condition().test.size();
  if (!has_all(results, {all, none}) || tests < 2) return finding;
  const Figure cost = results.ratio({none, 0}, {all, 0}, results.all_joints());
  finding.verdict = below(cost, 1.0 + kNothing);
  finding.evidence = fmt::format("without encoders {} before homing", percent(cost));
  // Both are of the same run, because runs differ in difficulty, homed or not.
  for (std::size_t i = 1; i < tests; ++i) {
    const Figure harm = results.ratio({all, i}, {none, i}, results.all_joints());
    finding.verdict = both(finding.verdict, above(harm, kMarkedRatio));
    finding.evidence += fmt::format("; after {}: with them {}", i, percent(harm));
  }
  finding.evidence += ", against the same run without; the limit is +30 %";
  return finding;
}

Finding homings_guide(const ConditionResults& results) {
  Finding finding =
      begun(results, "homing_guided", "Trained on several homings, encoder values do no harm");
  const RowId all = without(kAllFeatures);
  const RowId none = without(kNoEncoder);
  if (!has_all(results, {all, none})) return finding;
  finding.verdict = Verdict::kHolds;
  for (std::size_t i = 0; i < results.condition().test.size(); ++i) {
    const Figure harm = results.ratio({all, i}, {none, i}, results.all_joints());
    finding.verdict = both(finding.verdict, below(harm, kMarkedRatio));
    finding.evidence +=
        fmt::format("{}after {}: all features {}", i == 0 ? "" : "; ", i, percent(harm));
  }
  finding.evidence += ", against no encoder features; the limit is +30 %";
  return finding;
}

std::vector<Finding> findings_of(const ConditionResults& condition) {
  if (condition.condition().homing) {
    return {condition.condition().rehomed ? homings_guide(condition) : encoders_break(condition)};
  }
  return {poses_matter_most(condition),
          end_effector_stands_in(condition),
          inaccurate_poses_worse(condition, NoiseInto::kInputs),
          inaccurate_poses_worse(condition, NoiseInto::kBelievedAsWell),
          direction_of_torque(condition),
          missing_torque_worse(condition),
          joint_three_needs_torque(condition),
          joint_two_carries(condition),
          joint_two_spoils(condition),
          joints_one_and_three_are_free(condition)};
}

/// A test with a run seed of the training is none, whatever its figures show.
std::vector<std::string> same_seed_sentences(const learn::SharedSeeds& shared) {
  return learn::sentences_of({shared.runs, {}});
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
    for (Finding& finding : findings_of(condition)) {
      for (const std::string& sentence : same_seed_sentences(condition.condition().shared))
        finding.evidence += (finding.evidence.empty() ? "" : "; ") + sentence;
      findings.push_back(std::move(finding));
    }
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
