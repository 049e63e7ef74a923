// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/cable_members.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Kind = CableMember::Kind;

VectorXd logs(std::initializer_list<double> values) {
  VectorXd out(static_cast<Index>(values.size()));
  Index i = 0;
  for (const double value : values) out[i++] = std::log(std::max(value, 1e-15));
  return out;
}

/// Where a fit of the member begins: numbers at which it makes an error of that scale.
VectorXd start_of(Kind kind, const Series& s, double scale) {
  const double load = std::max(1e-9, s.training_rms(s.transmitted));
  const double compliance = std::max(s.cable.compliance, 1e-12);
  switch (kind) {
    case Kind::kCompliance:
      return logs({scale / load});
    case Kind::kGap:
      return logs({scale});
    case Kind::kStrands:
      return logs({0.3 / compliance,
                   0.3 * std::max(range_of(s, cable_stretch(s, s.cable)), s.rest_width()),
                   std::exp(0.5), 1.0});
    case Kind::kCreep:
      return logs({scale / load, 6.0, 1.0});
    case Kind::kFriction:
      return logs({scale / compliance});
    default:
      return logs({1.0});
  }
}

/// Creep that is over before the arm has moved is stretch, and one that the recording is too short
/// to see the end of is a drift; and it begins between none of it and half as much again, with room
/// for noise.
void limit_creep(const FormCandidate& creep, CableMember& member) {
  if (!creep.shapes.empty()) {
    member.low[1] = std::log(creep.shapes.front()[0]);
    member.high[1] = std::log(creep.shapes.back()[0]);
  }
  member.low[2] = -0.3;
  member.high[2] = 1.2;
}

CableMember member_of(Kind kind, std::size_t candidate, const ChannelModel& model, double scale) {
  const VectorXd start = start_of(kind, *model.series, scale);
  const VectorXd any = VectorXd::Constant(start.size(), std::numeric_limits<double>::infinity());
  CableMember member{kind, candidate, start, -any, any};
  if (kind == Kind::kCreep) limit_creep(*model.candidates[candidate], member);
  // With room for what the linear terms add to it.
  if (kind == Kind::kStrands) {
    // Strands that never slip are a stiffer cable.
    const std::vector<Shape>& widths = model.candidates[candidate]->shapes;
    if (!widths.empty()) member.high[1] = std::log(widths.back()[0]);
    member.high[0] = std::log(0.8 * kMostStrands / model.series->cable.compliance);
    member.low[2] = 0.0;
    member.high[2] = 1.0;
    member.low[3] = -1.0;
    member.high[3] = 1.0;
  }
  return member;
}

bool of_replay(const EffectForm& form, const Series& s) {
  return form.from().empty() && replayed(s) && !form.nominal_term();
}

}  // namespace

std::optional<Kind> cable_kind(const EffectForm& form, const Series& s) {
  if (!replayed(s)) return std::nullopt;
  const bool elastic = s.cable.compliance > 0.0;
  const bool number = form.nominal_term().has_value();
  if (!number && !of_replay(form, s)) return std::nullopt;
  switch (form.traits().cable) {
    case CablePart::kSpring:
      return number ? Kind::kStiffnessOff : Kind::kCompliance;
    case CablePart::kFriction:
      if (number) return Kind::kFrictionOff;
      return elastic ? std::optional(Kind::kFriction) : std::nullopt;
    case CablePart::kWeight:
      return number ? std::optional(Kind::kWeightOff) : std::nullopt;
    case CablePart::kGap:
      return number ? std::nullopt : std::optional(Kind::kGap);
    case CablePart::kCreep:
      return number ? std::nullopt : std::optional(Kind::kCreep);
    case CablePart::kStrands:
      return !number && elastic && s.cable.strand_stiffness <= 0.0 ? std::optional(Kind::kStrands)
                                                                   : std::nullopt;
    case CablePart::kNone:
      break;
  }
  return std::nullopt;
}

void CableMember::add_to(CableNumbers& cable, const VectorXd& log_values) const {
  const double first = std::exp(log_values[0]);
  const double second = log_values.size() > 1 ? std::exp(log_values[1]) : 0.0;
  switch (kind) {
    case Kind::kCompliance:
      cable.compliance += first;
      break;
    case Kind::kGap:
      cable.gap_half_width += first;
      break;
    case Kind::kStrands:
      cable.strand_stiffness = first;
      cable.strand_yield = second;
      cable.strand_openness = log_values[2];
      cable.strand_start = log_values[3];
      break;
    case Kind::kCreep:
      cable.creep_compliance = first;
      cable.creep_time_s = second;
      cable.creep_start = 1.0 - log_values[2];
      break;
    case Kind::kFriction:
      cable.friction_level += first;
      break;
    case Kind::kStiffnessOff:
      cable.compliance /= first;
      break;
    case Kind::kFrictionOff:
      cable.friction_level *= first;
      break;
    case Kind::kWeightOff:
      cable.weight_scale *= first;
      break;
  }
}

std::vector<CableMember> cable_members(const ChannelModel& model, double scale) {
  std::vector<CableMember> members;
  for (std::size_t c = 0; c < model.candidates.size(); ++c) {
    const FormCandidate& candidate = *model.candidates[c];
    if (!candidate.untestable.empty()) continue;
    const auto kind = cable_kind(*candidate.form, *model.series);
    if (kind) members.push_back(member_of(*kind, c, model, scale));
  }
  return members;
}

CableNumbers cable_with(const Series& series, const CableSubset& subset) {
  CableNumbers cable = series.cable;
  for (std::size_t m = 0; m < subset.members.size(); ++m)
    subset.members[m]->add_to(cable, subset.log_values[m]);
  return cable;
}

void move_nominal(ChannelModel& model, const CableNumbers& cable) {
  constexpr double kStep = 0.05;
  const Series& s = *model.series;
  const VectorXd stretch = cable_stretch(s, cable);
  for (std::size_t term = 0; term < model.nominal_ids.size(); ++term) {
    const std::string number = model.nominal_ids[term] + "." + model.nominal_parameters[term];
    CableNumbers changed = cable;
    if (number == "compliance.stiffness") {
      changed.compliance += s.cable.compliance * (1.0 / (1.0 + kStep) - 1.0);
    } else if (number == "gravity.weight_scale") {
      changed.weight_scale *= 1.0 + kStep;
    } else if (number == "joint_friction.level") {
      changed.friction_level += kStep * s.cable.friction_level;
    } else if (number == "joint_friction.presliding") {
      changed.friction_presliding *= std::pow(1.0 + kStep, 3);
    } else {
      continue;
    }
    const VectorXd column = (stretch - cable_stretch(s, changed)) / kStep;
    model.free_base.col(static_cast<Index>(term) + 1) = model.blocks.gather(column);
    model.moved_terms[term] = column;
  }
  model.hold_nominal();
}

std::vector<Chosen> chosen_of(const ChannelModel& model, const CableSubset& subset) {
  const Series& s = *model.series;
  std::vector<Chosen> out;
  CableNumbers cable = s.cable;
  VectorXd before = cable_stretch(s, cable);
  for (std::size_t m = 0; m < subset.members.size(); ++m) {
    const CableMember& member = *subset.members[m];
    const VectorXd& log_values = subset.log_values[m];
    member.add_to(cable, log_values);
    const VectorXd after = cable_stretch(s, cable);
    const double first = std::exp(log_values[0]);
    Chosen chosen;
    chosen.candidate = member.candidate;
    // What the form's own coefficient is worth at these numbers.
    double coefficient = 1.0;
    if (member.is_number()) {
      coefficient = first - 1.0;
    } else if (log_values.size() > 1) {
      coefficient = first;
      chosen.shape = {std::exp(log_values[1])};
    } else {
      chosen.shape = {first};
    }
    if (std::abs(coefficient) < 1e-12) coefficient = 1e-12;
    chosen.everywhere = (before - after) / coefficient;
    chosen.columns = model.blocks.gather(chosen.everywhere);
    before = after;
    out.push_back(std::move(chosen));
  }
  return out;
}

}  // namespace ravencal::diagnose
