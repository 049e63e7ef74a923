// SPDX-License-Identifier: Apache-2.0
#include "physics/tolerance_keys.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "core/known_words.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::physics {
namespace {

struct Number {
  std::string_view id, parameter;  ///< the second may be empty
};

/// Numbers that a joint has as such, with the effect that would change them.
constexpr std::array<Number, 8> kOfEveryJoint = {{
    {"inertia_error", "inertia"},
    {"gravity", "weight_scale"},
    {"centre_of_mass", ""},
    {"controller_gain", ""},
    {"link_length", ""},
    {"link_axial", ""},
    {"link_across", ""},
    {"joint_zero", ""},
}};

void add_keys(const Number& number, std::vector<std::string>& keys) {
  keys.emplace_back(number.id);
  if (number.parameter.empty()) return;
  keys.emplace_back(number.parameter);
  keys.push_back(fmt::format("{}.{}", number.id, number.parameter));
  keys.push_back(fmt::format("{}_{}", number.id, number.parameter));
}

std::vector<std::string> keys_of(const Joint& joint) {
  std::vector<std::string> keys;
  for (const Effect& effect : joint.effects) {
    for (const auto& [parameter, value] : effect.parameters)
      keys.push_back(fmt::format("{}.{}", effect.id, parameter));
  }
  for (const Number& number : kOfEveryJoint)
    keys.emplace_back(number.parameter.empty() ? number.id : number.parameter);
  return keys;
}

}  // namespace

std::vector<std::string> tolerance_keys() {
  std::vector<std::string> keys;
  for (const Number& number : kOfEveryJoint) add_keys(number, keys);
  for (const EffectSpec& spec : effect_specs()) {
    for (const ParameterSpec& parameter : spec.parameters)
      add_keys({spec.id, parameter.name}, keys);
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

std::string flaw_of_tolerance(std::string_view key, const Joint& joint) {
  const std::vector<std::string> keys = tolerance_keys();
  if (std::binary_search(keys.begin(), keys.end(), key)) return {};
  const auto meant = core::likely_meant(key, keys);
  return fmt::format(
      "tolerance of '{}', which is no number of a plant; {}a key is an effect, a parameter or "
      "\"EFFECT.PARAMETER\", without unit; joint '{}' has: {}",
      key, meant ? fmt::format("did you mean '{}'? ", *meant) : "", joint.name,
      fmt::join(keys_of(joint), ", "));
}

std::optional<double> stated_tolerance(const Joint& joint, const std::string& id,
                                       const std::string& parameter) {
  for (const std::string& key : {id + "." + parameter, id + "_" + parameter, parameter, id}) {
    const auto it = joint.tolerance.find(key);
    if (it != joint.tolerance.end()) return it->second;
  }
  return std::nullopt;
}

double tolerance_of(const Joint& joint, const std::string& id, const std::string& parameter) {
  return stated_tolerance(joint, id, parameter).value_or(kUnstatedTolerance);
}

}  // namespace ravencal::physics
