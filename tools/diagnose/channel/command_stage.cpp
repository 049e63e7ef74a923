// SPDX-License-Identifier: Apache-2.0
//
// The command stage: what the controller should have asked of the drive, from its own inputs,
// against what was recorded.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/channel/channel.hpp"
#include "diagnose/channel/command_gain.hpp"
#include "diagnose/channel/command_pulses.hpp"
#include "diagnose/channel/control_law.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

/// Edges of noise, not of a disturbance.
constexpr std::size_t kMostPulses = 1000;

/// Recordings that a fit may see, with enough usable rows.
std::vector<CommandStretch> testable_recordings(const Series& s, const std::vector<char>& usable) {
  std::vector<CommandStretch> stretches;
  const int recordings = s.recording.back() + 1;
  for (int r = 0; r < recordings; ++r) {
    const auto [begin, end] = std::equal_range(s.recording.begin(), s.recording.end(), r);
    const Index first = begin - s.recording.begin();
    const Index last = end - s.recording.begin();
    if (std::count(usable.begin() + first, usable.begin() + last, 1) >= kLeastCommandRows)
      stretches.push_back({first, last, recordings == 1 ? 0 : r + 1});
  }
  return stretches;
}

bool brief(const Pulses& found, const Series& s) {
  return !found.pulses.empty() && found.pulses.size() < kMostPulses &&
         std::all_of(found.pulses.begin(), found.pulses.end(), [&](const Pulse& pulse) {
           return pulse.end_s - pulse.begin_s < kLongestPulse * s.t_s[s.rows() - 1];
         });
}

/// Why pulses would not be seen, or those that were seen prove nothing; empty if they would.
std::string pulses_untestable(const ControlLaw& law, const Pulses& found, const Series& s,
                              double chance) {
  if (law.explained < kLeastExplained) return unexplained(law.explained);
  const auto needed = static_cast<std::size_t>(least_pulses(chance));
  if (!brief(found, s) || found.pulses.size() >= needed) return "";
  return fmt::format("chance makes what may be {} pulses of its command; {} are needed",
                     found.pulses.size(), needed);
}

/// Looks for pulses of the command and takes those that it names out of the usable rows.
void judge_pulses(const Series& s, double chance, bool details, std::vector<char>& usable,
                  ChannelFindings& findings) {
  const ControlLaw law = fit_law(s, 0, s.rows(), Disturbance::kPulses);
  const Pulses found = find_pulses(s, law);
  if (brief(found, s) && name_pulses(found, s, law, chance, findings)) {
    for (const Pulse& pulse : found.pulses)
      std::fill(usable.begin() + pulse.first, usable.begin() + pulse.last, 0);
    return;
  }
  if (!details) return;
  NotFound entry{input_disturbance_kind().id(),
                 s.joint,
                 std::nullopt,
                 s.unit,
                 pulses_untestable(law, found, s, chance),
                 "size"};
  if (entry.not_testable_because.empty()) entry.detection_limit = found.threshold;
  findings.not_found.push_back(std::move(entry));
}

/// A gain may be set anew for each recording. What is said of all of them is the greatest limit, or
/// why one of them has none.
void judge_gains(const Series& s, const std::vector<CommandStretch>& recordings,
                 const std::vector<char>& usable, const GainQuestion& question,
                 ChannelFindings& findings) {
  NotFound entry{controller_gain_kind().id(), s.joint, std::nullopt, "1", "", "ratio"};
  if (recordings.empty())
    entry.not_testable_because =
        fmt::format("no recording has {} rows whose command is below its limit", kLeastCommandRows);
  bool named = false;
  for (const CommandStretch& recording : recordings) {
    GainAnswer answer = judge_gain(s, recording, usable, question);
    if (answer.effect) {
      findings.effects.push_back(std::move(*answer.effect));
      named = true;
    }
    if (answer.limit)
      entry.detection_limit = std::max(entry.detection_limit.value_or(0.0), *answer.limit);
    if (!answer.untestable.empty() && entry.not_testable_because.empty())
      entry.not_testable_because =
          recording.number == 0
              ? answer.untestable
              : fmt::format("in recording {}, {}", recording.number, answer.untestable);
  }
  if (named || !question.details) return;
  if (!entry.not_testable_because.empty()) entry.detection_limit.reset();
  findings.not_found.push_back(std::move(entry));
}

}  // namespace

ChannelFindings analyse_command(const Series& series, const physics::Plant& plant,
                                const ChannelOptions& options) {
  ChannelFindings findings;
  findings.joint = series.joint;
  findings.stage = Stage::kCommand;
  findings.unit = series.unit;
  const physics::Joint& joint = plant.joints[plant.joint_index(series.joint).value_or(0)];
  std::vector<char> usable = rows_of_law(series);
  const std::vector<CommandStretch> recordings = testable_recordings(series, usable);
  GainQuestion question;
  question.nominal =
      joint.controller->kp_n_m_per_rad * joint.reduction * joint.reduction / joint.gearbox_ratio;
  const auto stated = joint.tolerance.find(controller_gain_kind().id());
  question.tolerance = stated == joint.tolerance.end() ? kGainTolerance : stated->second;
  // Bonferroni: the pulses are one question, the gain of each recording another one.
  question.chance = options.gates.alpha / static_cast<double>(recordings.size() + 1);
  question.details = options.details;
  judge_pulses(series, question.chance, options.details, usable, findings);
  if (question.nominal > 0.0) judge_gains(series, recordings, usable, question, findings);
  return findings;
}

}  // namespace ravencal::diagnose
