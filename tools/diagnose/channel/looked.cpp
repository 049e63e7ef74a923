// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/looked.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/median.hpp"
#include "diagnose/effects/regimes.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

/// The filter of efforts, weights (1 - u^2)^2 over +-h, halves the power at this number over h.
constexpr double kHalfPower = 0.345;

/// From one period in the longest stretch to half the row rate or to the filter of efforts.
Interval band_of(const Series& s) {
  double longest = 0.0, begin = s.t_s[0];
  std::vector<double> steps;
  for (Index i = 1; i < s.rows(); ++i) {
    if (s.fresh[static_cast<std::size_t>(i)] != 0) {
      begin = s.t_s[i];
      continue;
    }
    longest = std::max(longest, s.t_s[i] - begin);
    steps.push_back(s.t_s[i] - s.t_s[i - 1]);
  }
  if (steps.empty() || !(longest > 0.0)) return {0.0, 0.0};
  const double usual_s = core::upper_median(std::move(steps));
  double highest = usual_s > 0.0 ? 0.5 / usual_s : 0.0;
  const bool filtered = s.stage == Stage::kDrive && s.motion.half_width_s > 0.0;
  if (filtered) highest = std::min(highest, kHalfPower / s.motion.half_width_s);
  return {1.0 / longest, highest};
}

void add_motion(const Series& s, LookedAt& looked) {
  const double least = rest_speed(s);
  double resting = 0.0, valid = 0.0;
  looked.position = s.training_range(s.motion.q);
  for (Index i = 0; i < s.rows(); ++i) {
    if (s.valid[static_cast<std::size_t>(i)] == 0) continue;
    const double speed = std::abs(s.motion.v[i]);
    valid += 1.0;
    resting += speed < least ? 1.0 : 0.0;
    looked.fastest = std::max(looked.fastest, speed);
  }
  looked.rest_share = valid > 0.0 ? resting / valid : 0.0;
}

LookedAt looked_at(const Series& s) {
  LookedAt looked;
  looked.joint = s.joint;
  looked.stage = stage_word(s.stage);
  looked.position_unit = position_unit(s);
  looked.effort_unit = effort_unit(s);
  for (Index i = 0; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.valid[n] == 0) continue;
    ++looked.rows;
    looked.held_out_rows += s.held_out[n] != 0 ? 1U : 0U;
  }
  looked.band_hz = band_of(s);
  if (s.motion.q.size() != s.rows() || s.motion.v.size() != s.rows()) return looked;
  add_motion(s, looked);
  // The command is compared with its law as a whole.
  if (s.stage == Stage::kCommand) return looked;
  for (const RegimeOf& c : circumstances(s)) {
    looked.circumstances.push_back(c.name);
    if (c.name == "load") looked.load = s.training_range(c.value);
  }
  return looked;
}

std::string reason_for(const SeriesSet& set, const std::string& joint, std::string_view stage) {
  if (stage == "command") {
    return "the recording or the plant lacks the command's inputs, its output or its control law";
  }
  const auto reason = set.not_possible.find(joint);
  return reason != set.not_possible.end() ? reason->second : "no recorded signals show it";
}

}  // namespace

void add_looked_at(const SeriesSet& set, const physics::Plant& plant, Report& report) {
  for (const Series& s : set.series) {
    if (s.rows() > 0) report.looked_at.push_back(looked_at(s));
  }
  constexpr std::array kStages = {"command", "drive", "transmission"};
  for (const physics::Joint& joint : plant.joints) {
    for (const std::string_view stage : kStages) {
      const bool seen =
          std::any_of(report.looked_at.begin(), report.looked_at.end(),
                      [&](const LookedAt& l) { return l.joint == joint.name && l.stage == stage; });
      if (!seen)
        report.not_looked_at.push_back(
            {joint.name, std::string(stage), reason_for(set, joint.name, stage)});
    }
  }
}

}  // namespace ravencal::diagnose
