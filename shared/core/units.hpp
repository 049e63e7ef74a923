// SPDX-License-Identifier: Apache-2.0
//
// Units by name and their factors to SI. A recording stores values in the unit in which they
// arrived; readers convert to SI once, here.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ravencal::core {

/// A named unit: value_si = value * to_si.
struct Unit {
  std::string_view name;  ///< as written in profiles and recordings, e.g. "deg", "mm", "um", "N_m"
  std::string_view si_name;  ///< e.g. "rad", "m", "N_m"
  double to_si;
};

/// All known units, for documentation.
std::span<const Unit> known_units();
/// Their names, for error messages.
std::vector<std::string> unit_names();

/// Looks a unit up by name; nullopt if unknown.
std::optional<Unit> find_unit(std::string_view name);

/// Unit in which a person reads a value: deg for rad, mm for m, itself for any other.
struct DisplayUnit {
  std::string name;
  double per_si = 1.0;
};
DisplayUnit display_unit(std::string_view si_unit);

}  // namespace ravencal::core
