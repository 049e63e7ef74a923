// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/units.hpp"
#include "record/profile_builtin.hpp"

namespace ravencal::record {
namespace {

struct Prefix {
  std::string_view word;
  Role role;
};

// Documented in FORMATS.md; `truth.elbow_rad` is the truth of the joint "elbow".
constexpr std::array<Prefix, 13> kPrefixes = {{
    {"truth", Role::kJointTruth},
    {"truth_reading", Role::kTruthReading},
    {"estimate", Role::kJointEstimate},
    {"desired", Role::kDesiredPosition},
    {"desired_velocity", Role::kDesiredVelocity},
    {"motor", Role::kMotorPosition},
    {"motor_velocity", Role::kMotorVelocity},
    {"input", Role::kDriveInput},
    {"torque", Role::kDriveTorque},
    {"load", Role::kLoad},
    {"temperature", Role::kTemperature},
    {"status", Role::kStatus},
    {"feature", Role::kFeature},
}};

/// The longest known unit at the end of `word`, after an underscore: "tau_N_m" has N_m, not m.
std::optional<core::Unit> unit_suffix(std::string_view word) {
  std::optional<core::Unit> best;
  for (const core::Unit& unit : core::known_units()) {
    const bool fits = word.size() > unit.name.size() + 1 && word.ends_with(unit.name) &&
                      word[word.size() - unit.name.size() - 1] == '_';
    if (fits && (!best || unit.name.size() > best->name.size())) best = unit;
  }
  return best;
}

Channel channel_of(std::string_view word, const core::Unit& unit) {
  const std::string_view name = word.substr(0, word.size() - unit.name.size() - 1);
  Channel channel{std::string(name), std::string(unit.name), Role::kFeature, ""};
  const std::size_t dot = name.find('.');
  if (dot == std::string_view::npos) return channel;
  const auto prefix = std::find_if(kPrefixes.begin(), kPrefixes.end(),
                                   [&](const Prefix& p) { return p.word == name.substr(0, dot); });
  if (prefix == kPrefixes.end()) return channel;
  channel.role = prefix->role;
  channel.joint = name.substr(dot + 1);
  return channel;
}

std::string unit_names() {
  std::string names;
  for (const core::Unit& unit : core::known_units()) {
    names += (names.empty() ? "" : " ") + std::string(unit.name);
  }
  return names;
}

bool take_time(Profile& profile, std::size_t index, std::string_view word) {
  if (profile.time_index) return false;
  for (const std::string_view unit : {"s", "ms", "us", "ns"}) {
    if (word != fmt::format("t_{}", unit) && word != fmt::format("time_{}", unit)) continue;
    profile.time_index = index;
    profile.clock.unit = unit;
    return true;
  }
  return false;
}

}  // namespace

Profile generic_profile() {
  Profile profile;
  profile.name = "generic";
  return profile;
}

core::Status add_generic_channels(Profile& profile, std::span<const std::string> header,
                                  const std::string& place, bool has_stamps) {
  for (std::size_t i = 0; i < header.size(); ++i) {
    const std::string& word = header[i];
    if (take_time(profile, i, word)) continue;
    const auto unit = unit_suffix(word);
    if (!unit) {
      return core::Error{
          core::ErrorCode::kData,
          fmt::format("{}: column {} ('{}'): unknown unit; the name must end in _UNIT with one "
                      "of: {} (1 = no unit)",
                      place, i + 1, word, unit_names())};
    }
    ProfileChannel channel;
    channel.channel = channel_of(word, *unit);
    channel.index = i;
    profile.channels.push_back(std::move(channel));
  }
  if (profile.time_index || has_stamps) return {};
  return core::Error{
      core::ErrorCode::kData,
      fmt::format("{}: no column of time; call it t_s (or t_ms, t_us, t_ns)", place)};
}

}  // namespace ravencal::record
