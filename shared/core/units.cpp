// SPDX-License-Identifier: Apache-2.0
#include "core/units.hpp"
#include "core/constants.hpp"

#include <algorithm>
#include <array>
#include <numbers>

namespace ravencal::core {
namespace {

constexpr std::array<Unit, 26> kUnits = {{
    {"1", "1", 1.0},
    {"rad", "rad", 1.0},
    {"deg", "rad", kRadPerDeg},
    {"mrad", "rad", 1e-3},
    {"m", "m", 1.0},
    {"cm", "m", 1e-2},
    {"mm", "m", 1e-3},
    {"um", "m", 1e-6},
    {"m_x_180_over_pi", "m", kRadPerDeg},
    {"rad_per_s", "rad_per_s", 1.0},
    {"deg_per_s", "rad_per_s", kRadPerDeg},
    {"m_per_s", "m_per_s", 1.0},
    {"mm_per_s", "m_per_s", 1e-3},
    {"m_per_s_x_180_over_pi", "m_per_s", kRadPerDeg},
    {"N_m", "N_m", 1.0},
    {"mN_m", "N_m", 1e-3},
    {"N", "N", 1.0},
    {"V", "V", 1.0},
    {"A", "A", 1.0},
    {"degC", "degC", 1.0},
    {"s", "s", 1.0},
    {"ms", "s", 1e-3},
    {"us", "s", 1e-6},
    {"ns", "s", 1e-9},
    {"counts", "counts", 1.0},
    {"dac_counts", "dac_counts", 1.0},
}};

}  // namespace

std::span<const Unit> known_units() { return kUnits; }

std::vector<std::string> unit_names() {
  std::vector<std::string> names;
  for (const Unit& unit : kUnits) names.emplace_back(unit.name);
  return names;
}

std::optional<Unit> find_unit(std::string_view name) {
  const auto it =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.name == name; });
  if (it == kUnits.end()) return std::nullopt;
  return *it;
}

DisplayUnit display_unit(std::string_view si_unit) {
  if (si_unit == "rad") return {"deg", kDegPerRad};
  if (si_unit == "m") return {"mm", 1e3};
  return {std::string(si_unit), 1.0};
}

}  // namespace ravencal::core
