// SPDX-License-Identifier: Apache-2.0
//
// From effects to what makes them: one weight on the tool loads every drive, and what motor and
// gearbox rub is friction at rest, friction in motion and what lies between.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// What would part an effect of the cause from a rival.
struct Parting {
  std::string id, rival;
  std::string experiment;
  std::optional<double> minutes;  ///< none where the menu of recordings has nothing
};

struct Cause {
  std::string name;                  ///< "load on the arm", "gain error"
  std::string sentence;              ///< what it does, in plain words
  std::string status;                ///< named, tied, out_of_tolerance or no_name
  std::vector<std::string> joints;   ///< on which it acts
  std::vector<std::size_t> effects;  ///< indices into Report::effects
  std::vector<Parting> partings;
};

/// Every effect of the report in one of them, in the report's order.
std::vector<Cause> causes_of(const Report& report);

}  // namespace ravencal::diagnose
