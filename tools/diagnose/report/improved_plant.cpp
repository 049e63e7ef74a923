// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/improved_plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/effects/effect_kind.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::diagnose {
namespace {

/// The plant and what it has no words for.
struct Improved {
  physics::Plant plant;
  std::vector<NamedEffect> beyond;
};

Improved improve(const physics::Plant& plant, const Report& report) {
  Improved out{plant, {}};
  out.plant.hash = 0;
  // First the numbers that only moved within their tolerance, then what has no name; names
  // overwrite both.
  for (const NamedEffect& e : report.refitted) {
    const auto index = plant.joint_index(e.joint);
    const EffectKind& kind = effect_kind(e.id);
    if (index && kind.refits(plant.joints[*index]))
      kind.improve(out.plant, {plant, *index, e, report.effects});
  }
  for (const Routing& routing : report.routings) {
    const auto index = plant.joint_index(routing.joint);
    if (!index) continue;
    for (const physics::Through through : {physics::Through::kLink, physics::Through::kDrive})
      if (routing.through == physics::through_word(through))
        out.plant.joints[*index].coupling_through = through;
  }
  std::vector<NamedEffect> found = report.kept;
  found.insert(found.end(), report.effects.begin(), report.effects.end());
  for (NamedEffect& e : found) {
    const auto index = plant.joint_index(e.joint);
    if (!index || e.id == kUnknown || e.parameters.empty()) continue;
    if (!effect_kind(e.id).improve(out.plant, {plant, *index, e, report.effects}))
      out.beyond.push_back(std::move(e));
  }
  for (const NamedEffect& e : report.effects) {
    if (const auto index = plant.joint_index(e.joint))
      effect_kind(e.id).settle(out.plant, {plant, *index, e, report.effects});
  }
  return out;
}

/// A comment has no control characters, and names are data.
std::string comment(std::string text) {
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == '\x7f'; };
  std::replace_if(text.begin(), text.end(), control, ' ');
  return "# " + text + "\n";
}

std::string comment_for(const NamedEffect& e) {
  std::string text = fmt::format("  {} ({}): {}", e.joint, e.stage, e.id);
  for (const NamedParameter& p : e.parameters) {
    if (!p.name.starts_with("begin_"))
      text += fmt::format(", {} = {:.6g} {}", p.name, p.value, p.unit);
  }
  return comment(std::move(text));
}

}  // namespace

physics::Plant improved_plant(const physics::Plant& plant, const Report& report) {
  return improve(plant, report).plant;
}

std::string improved_plant_text(const physics::Plant& plant, const Report& report) {
  const Improved improved = improve(plant, report);
  std::string text = comment(plant.robot.name + ", improved by `ravencal diagnose`.") + "\n" +
                     physics::plant_text(improved.plant);
  if (!improved.beyond.empty()) text += "\n# Found, but beyond what `ravencal simulate` can run:\n";
  for (const NamedEffect& e : improved.beyond) text += comment_for(e);
  return text;
}

}  // namespace ravencal::diagnose
