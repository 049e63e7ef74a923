// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

#include "core/constants.hpp"
#include "plugin_host/plugin_library.hpp"
#include "shadow/operation.hpp"

namespace ravencal::shadow {
namespace {

using Json = nlohmann::ordered_json;

struct Shown {
  const char* joint;
  const char* si;
  const char* unit;
  double per_si;
};
constexpr std::array<Shown, RAVENCAL_JOINTS> kShown = {
    {{"shoulder", "rad", "deg", core::kDegPerRad},
     {"elbow", "rad", "deg", core::kDegPerRad},
     {"insertion", "m", "mm", 1e3}}};

double seconds(const Operation& operation, std::uint64_t ticks) {
  return static_cast<double>(ticks) * operation.tick_s;
}

double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

std::uint64_t in_doubt(const Operation& operation, std::uint32_t doubt) {
  return operation.ticks_in_doubt[static_cast<std::size_t>(std::countr_zero(doubt))];
}

std::string joint_line(const JointOperation& joint, const Shown& shown) {
  return fmt::format("  {:<10}{:>10.3f}{:>12.4f}{:>12.4f}{:>10.3f}   {:.1f} to {:.1f} {}\n",
                     shown.joint, joint.largest_ji * shown.per_si,
                     joint.press_change_ji * shown.per_si, joint.follow_change_ji * shown.per_si,
                     joint.offset_ji * shown.per_si, joint.lowest_ji * shown.per_si,
                     joint.highest_ji * shown.per_si, shown.unit);
}

}  // namespace

std::vector<std::string> findings(const Operation& operation) {
  std::vector<std::string> found;
  if (operation.ticks_in_state[RAVENCAL_STATE_FAULT] > 0 ||
      in_doubt(operation, RAVENCAL_DOUBT_NETWORK) > 0) {
    found.emplace_back("the network gave a result that is no number: FAULT");
  }
  if (in_doubt(operation, RAVENCAL_DOUBT_PRESS) > 0) {
    found.emplace_back(
        "a press found less of the correction in the desired joints than was applied: compare the "
        "settings' limits with the controller's, and its lines with the README's");
  }
  for (std::size_t j = 0; j < kShown.size(); ++j) {
    if (operation.joints[j].press_change_ji == 0.0) continue;
    found.push_back(
        fmt::format("a press changed the correction of the {} by {:.4f} {}", kShown[j].joint,
                    operation.joints[j].press_change_ji * kShown[j].per_si, kShown[j].unit));
  }
  if (operation.long_steps > 0) {
    found.push_back(fmt::format("{} steps took longer than half a cycle, the longest {:.0f} us",
                                operation.long_steps, operation.longest_step_s * 1e6));
  }
  return found;
}

std::string operation_text(const Operation& operation) {
  const bool is_shadow = operation.shadow_ticks == operation.ticks;
  std::string text = fmt::format(
      "{:.1f} s, {} ticks, {} lost; {:.1f} % of them in shadow\n"
      "pedal down {:.1f} s in {} presses, of which {} {:.1f} %\n\nstate{}\n",
      seconds(operation, operation.ticks), operation.ticks, operation.lost_ticks,
      percent(operation.shadow_ticks, operation.ticks),
      seconds(operation, operation.pedal_down_ticks), operation.presses,
      is_shadow ? "would be corrected" : "corrected",
      percent(operation.corrected_ticks, operation.pedal_down_ticks),
      is_shadow ? " that it would be in" : "");
  const auto add = [&](const char* name, std::uint64_t ticks) {
    if (ticks == 0) return;
    text += fmt::format("  {:<14}{:>10.2f} s {:>6.2f} %\n", name, seconds(operation, ticks),
                        percent(ticks, operation.ticks));
  };
  for (std::size_t state = 0; state < operation.ticks_in_state.size(); ++state) {
    add(plugin_host::state_name(static_cast<std::int32_t>(state)), operation.ticks_in_state[state]);
  }
  const bool has_doubt =
      std::any_of(operation.ticks_in_doubt.begin(), operation.ticks_in_doubt.end(),
                  [](std::uint64_t ticks) { return ticks > 0; });
  text += has_doubt ? "doubt\n" : "doubt: none\n";
  for (std::size_t kind = 0; kind < operation.ticks_in_doubt.size(); ++kind) {
    add(plugin_host::doubt_name(kind), operation.ticks_in_doubt[kind]);
  }
  text += "\ncorrection     largest    at a press   per cycle    offset   raw joint\n";
  for (std::size_t j = 0; j < kShown.size(); ++j) {
    text += joint_line(operation.joints[j], kShown[j]);
  }
  text += fmt::format("\nlongest step {:.1f} us; {} beyond half a cycle\n",
                      operation.longest_step_s * 1e6, operation.long_steps);
  for (const std::string& finding : findings(operation)) text += "finding: " + finding + "\n";
  return text;
}

std::string operation_json(const Operation& operation) {
  Json json = {{"schema", 1},
               {"ticks", operation.ticks},
               {"lost_ticks", operation.lost_ticks},
               {"tick_s", operation.tick_s},
               {"shadow_ticks", operation.shadow_ticks},
               {"pedal_down_ticks", operation.pedal_down_ticks},
               {"corrected_ticks", operation.corrected_ticks},
               {"presses", operation.presses},
               {"longest_step_s", operation.longest_step_s},
               {"long_steps", operation.long_steps}};
  for (std::size_t state = 0; state < operation.ticks_in_state.size(); ++state) {
    json["states"][plugin_host::state_name(static_cast<std::int32_t>(state))] =
        operation.ticks_in_state[state];
  }
  for (std::size_t kind = 0; kind < operation.ticks_in_doubt.size(); ++kind) {
    json["doubts"][plugin_host::doubt_name(kind)] = operation.ticks_in_doubt[kind];
  }
  for (std::size_t j = 0; j < kShown.size(); ++j) {
    const JointOperation& joint = operation.joints[j];
    json["joints"].push_back({{"joint", kShown[j].joint},
                              {"unit", kShown[j].si},
                              {"largest", joint.largest_ji},
                              {"press_change", joint.press_change_ji},
                              {"follow_change", joint.follow_change_ji},
                              {"offset", joint.offset_ji},
                              {"lowest", joint.lowest_ji},
                              {"highest", joint.highest_ji}});
  }
  json["findings"] = findings(operation);
  return json.dump(2) + "\n";
}

}  // namespace ravencal::shadow
