// SPDX-License-Identifier: Apache-2.0
#include "record/channel.hpp"

#include <algorithm>
#include <array>

namespace ravencal::record {
namespace {

constexpr std::array<std::string_view, 13> kRoleNames = {
    "desired_position", "desired_velocity", "motor_position", "motor_velocity", "joint_estimate",
    "joint_truth",      "truth_reading",    "drive_input",    "drive_torque",   "load",
    "temperature",      "status",           "feature"};

}  // namespace

std::string_view name_of(Role role) { return kRoleNames[static_cast<std::size_t>(role)]; }

std::vector<std::string> role_names() { return {kRoleNames.begin(), kRoleNames.end()}; }

std::optional<Role> role_from(std::string_view name) {
  const auto it = std::find(kRoleNames.begin(), kRoleNames.end(), name);
  if (it == kRoleNames.end()) return std::nullopt;
  return static_cast<Role>(it - kRoleNames.begin());
}

}  // namespace ravencal::record
