// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/improved_plant.hpp"

#include <utility>
#include <vector>

#include "diagnose/effects/effect_kind.hpp"

namespace ravencal::diagnose {
namespace {

/// Writes the finding into the plant; false if a plant has no place for it.
bool write_finding(const physics::Plant& plant, const Report& report, const NamedEffect& e,
                   physics::Plant& improved) {
  const auto index = plant.joint_index(e.joint);
  if (!index || e.id == kUnknown || e.parameters.empty()) return true;
  return effect_kind(e.id).improve(improved, {plant, *index, e, report.effects});
}

void write_refitted(const physics::Plant& plant, const Report& report, physics::Plant& improved) {
  for (const NamedEffect& e : report.refitted) {
    const auto index = plant.joint_index(e.joint);
    const EffectKind& kind = effect_kind(e.id);
    if (index && kind.refits(plant.joints[*index]))
      kind.improve(improved, {plant, *index, e, report.effects});
  }
}

void write_routings(const physics::Plant& plant, const Report& report, physics::Plant& improved) {
  for (const Routing& routing : report.routings) {
    const auto index = plant.joint_index(routing.joint);
    if (!index) continue;
    for (const physics::Through through : {physics::Through::kLink, physics::Through::kDrive})
      if (routing.through == physics::through_word(through))
        improved.joints[*index].coupling_through = through;
  }
}

}  // namespace

void improve(const physics::Plant& plant, Report& report) {
  report.improved = plant;
  report.improved.hash = 0;
  // First the numbers that only moved within their tolerance, then what has no name; names
  // overwrite both.
  write_refitted(plant, report, report.improved);
  write_routings(plant, report, report.improved);
  for (std::vector<NamedEffect>* found : {&report.kept, &report.effects})
    for (NamedEffect& e : *found)
      e.beyond_plants = !write_finding(plant, report, e, report.improved);
  for (const NamedEffect& e : report.effects) {
    if (const auto index = plant.joint_index(e.joint))
      effect_kind(e.id).settle(report.improved, {plant, *index, e, report.effects});
  }
}

physics::Plant improved_plant(const physics::Plant& plant, const Report& report) {
  Report copy = report;
  improve(plant, copy);
  return std::move(copy.improved);
}

}  // namespace ravencal::diagnose
