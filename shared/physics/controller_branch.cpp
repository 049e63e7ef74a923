// SPDX-License-Identifier: Apache-2.0
#include "physics/controller_branch.hpp"

#include <algorithm>

namespace ravencal::physics {
namespace {

constexpr ControllerBranch kMain = {
    .name = "main",
    .adds_gravity_torque = true,
    .holds_at_stops = true,
    .home_time_s = 2.5,
    .couples_velocities = false,
    .reads_encoders_before_sleep = true,
    .green_arm_first = false,  // serial numbers 22 (green) and 49 (gold)
    .arm_types = {49, 22},
    .sublevel_when_homed = 3,
    .cycles_to_reseed = 0,
};

constexpr ControllerBranch kCrtk = {
    .name = "crtk",
    .adds_gravity_torque = true,
    .holds_at_stops = true,
    .home_time_s = 3.0,
    .couples_velocities = true,
    .reads_encoders_before_sleep = true,
    .green_arm_first = true,  // serial numbers 50 (green) and 37 (gold)
    .arm_types = {0, 1},
    .sublevel_when_homed = 1,
    .cycles_to_reseed = 10,
};

constexpr std::array kBranches = {kMain, kCrtk};

}  // namespace

const ControllerBranch* find_controller_branch(std::string_view name) {
  const auto it = std::find_if(kBranches.begin(), kBranches.end(),
                               [&](const ControllerBranch& branch) { return branch.name == name; });
  return it == kBranches.end() ? nullptr : &*it;
}

std::string controller_branch_names() {
  std::string names;
  for (const ControllerBranch& branch : kBranches) {
    names += names.empty() ? "" : ", ";
    names += branch.name;
  }
  return names;
}

}  // namespace ravencal::physics
