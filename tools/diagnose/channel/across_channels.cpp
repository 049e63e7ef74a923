// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/across_channels.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"

namespace ravencal::diagnose {
namespace {

Friction friction_of(const NamedEffect& effect) { return traits_of(effect.id).friction; }

const EffectKind& dry_friction_of_drive() {
  const auto kinds = effect_kinds();
  return **std::find_if(kinds.begin(), kinds.end(), [](const EffectKind* kind) {
    return kind->traits().friction == Friction::kDry;
  });
}

const NamedParameter* level_of(const NamedEffect& effect) {
  return find_parameter(effect, "level");
}

/// True if friction behind the cable may have that level: the cable's loop does not deny it, was
/// not looked at, or is not the plant's.
bool says_otherwise(const Report& report, const std::vector<ChannelFindings>& findings,
                    const physics::Joint& joint, const Interval& level) {
  const bool denied = std::any_of(findings.begin(), findings.end(), [&](const ChannelFindings& f) {
    return f.joint == joint.name && f.friction_behind &&
           (f.friction_behind->second < level.first || f.friction_behind->first > level.second);
  });
  if (!denied) return true;
  return std::any_of(report.effects.begin(), report.effects.end(), [&](const NamedEffect& e) {
    if (e.joint != joint.name) return false;
    const Traits& traits = traits_of(e.id);
    const bool loop = traits.cable != CablePart::kNone && traits.cable != CablePart::kWeight;
    return (loop && e.stage == "transmission") ||
           (traits.friction == Friction::kDry && e.stage == "drive");
  });
}

/// Level of a friction beyond the plant's.
double level_beyond(const physics::Plant& plant, const NamedEffect& e) {
  const auto index = plant.joint_index(e.joint);
  const double known =
      e.out_of_tolerance && index ? plant.joints[*index].parameter(e.id, "level") : 0.0;
  return level_of(e)->value - known;
}

}  // namespace

void load_transmissions(SeriesSet& set, const std::vector<ChannelFindings>& findings) {
  for (std::size_t d = 0; d < set.series.size(); ++d) {
    const Eigen::VectorXd& found = findings[d].found_load;
    if (set.series[d].stage != Stage::kDrive) continue;
    for (Series& series : set.series) {
      if (series.joint != set.series[d].joint || series.stage != Stage::kTransmission) continue;
      series.constant_load = findings[d].constant_load;
      if (found.size() == 0) continue;
      if (series.weight.size() == 0) series.weight = Eigen::VectorXd::Zero(found.size());
      if (series.weight.size() != found.size()) continue;
      series.weight += found;
      series.found_load = found;
      series.weight_deviation = findings[d].weight_deviation;
      series.transmitted = series.cable_motion().tension;
    }
  }
}

std::optional<physics::Plant> with_friction_of_loop(const physics::Plant& plant,
                                                    const std::vector<ChannelFindings>& findings,
                                                    const std::string& joint) {
  for (const ChannelFindings& f : findings) {
    if (f.joint != joint || f.stage != Stage::kTransmission) continue;
    for (const NamedEffect& e : f.effects) {
      const NamedParameter* level = level_of(e);
      if (friction_of(e) != Friction::kBehindCable || level == nullptr) continue;
      physics::Plant agreed = plant;
      physics::Joint& own = agreed.joints[*plant.joint_index(joint)];
      const auto known = std::find_if(own.effects.begin(), own.effects.end(),
                                      [&](const physics::Effect& k) { return k.id == e.id; });
      if (known != own.effects.end()) {
        known->parameters["level"] = level->value;
      } else {
        own.effects.push_back({e.id, "", {{"level", level->value}}});
      }
      return agreed;
    }
  }
  return std::nullopt;
}

ChannelFindings fewer_beside_friction(const Series& drive, const physics::Plant& agreed,
                                      ChannelFindings alone, const ChannelOptions& options) {
  Series series = drive;
  series.cable = cable_numbers(agreed.joints[*agreed.joint_index(drive.joint)]);
  series.transmitted = series.cable_motion().tension;
  ChannelFindings beside = analyse_channel(series, agreed, options);
  const auto names = [](const ChannelFindings& f) {
    return f.effects.size() + f.unexplained.size();
  };
  if (names(beside) >= names(alone)) return alone;
  beside.mismatch = std::move(alone.mismatch);
  beside.placebo = std::move(alone.placebo);
  for (HeldOut& after : beside.held_out) {
    for (const HeldOut& before : alone.held_out)
      if (before.metric == after.metric) after.before = before.before;
  }
  return beside;
}

void merge_joint_friction(const physics::Plant& plant, Report& report) {
  for (const NamedEffect& loop : std::vector<NamedEffect>(report.effects)) {
    if (friction_of(loop) != Friction::kBehindCable || loop.stage != "transmission" ||
        level_of(loop) == nullptr)
      continue;
    const double behind = level_beyond(plant, loop);
    std::erase_if(report.effects, [&](const NamedEffect& e) {
      if (e.joint != loop.joint || e.stage != "drive") return false;
      // The cable's wind-up under that friction turns over a displacement, as presliding does. One
      // that the plant knows of is in the drive's prediction.
      const Friction friction = friction_of(e);
      if (friction == Friction::kOnset) return !loop.out_of_tolerance;
      if (friction != Friction::kBehindCable && friction != Friction::kDry) return false;
      if (level_of(e) == nullptr) return false;
      const double found = level_beyond(plant, e);
      return std::abs(found - behind) < kSameFriction * std::max(std::abs(found), std::abs(behind));
    });
  }
}

void move_friction_to_motor(const physics::Plant& plant,
                            const std::vector<ChannelFindings>& findings, Report& report) {
  for (NamedEffect& e : report.effects) {
    const auto index = plant.joint_index(e.joint);
    if (friction_of(e) != Friction::kBehindCable || e.stage != "drive" || !e.out_of_tolerance ||
        !index)
      continue;
    const physics::Joint& joint = plant.joints[*index];
    const double behind = joint.parameter(e.id, "level");
    const EffectKind& dry = dry_friction_of_drive();
    const double own = joint.parameter(dry.id(), "level");
    const NamedParameter level = e.parameters.front();
    const double more = level.value - behind;
    if (own + more <= 0.0 || says_otherwise(report, findings, joint, level.ci95)) continue;
    // What is behind the cable is the plant's word.
    const double unseen = kNormal95 * behind * tolerance_of(joint, e.id, "level");
    e.id = dry.id();
    e.out_of_tolerance = own > 0.0;
    std::erase(e.ambiguous_with, e.id);
    e.parameters = {{"level",
                     own + more,
                     level.unit,
                     {own + more - std::hypot(level.value - level.ci95.first, unseen),
                      own + more + std::hypot(level.ci95.second - level.value, unseen)}}};
  }
}

}  // namespace ravencal::diagnose
