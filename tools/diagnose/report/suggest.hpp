// SPDX-License-Identifier: Apache-2.0
//
// The next recording worth making: what would part effects that this one could not tell apart, name
// what is unexplained, or test what could not be tested. Cheapest first within each urgency.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/result.hpp"
#include "diagnose/findings/experiments.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

struct Suggestion {
  /// 0: parts a tie; 1: gives the unexplained a name; 2: tests what was untested; 3: confirms what
  /// was found, or that nothing was, where this recording did not go.
  int urgency = 0;
  std::string joint;
  std::string experiment;
  double minutes = 0.0;
  std::string why;
  Exercise motion = Exercise::kNone;
  std::vector<std::string> ids;  ///< effects that it asks for; of a tie the effect and its rival
};

/// What the diagnosed recordings reached of one joint: a further recording within it asks for
/// nothing that the robot has not done.
struct Explored {
  std::string joint, position_unit, effort_unit;
  Interval position{0.0, 0.0};
  double fastest = 0.0;          ///< position_unit per s
  std::optional<Interval> load;  ///< effort through the transmission, where it is known
};

/// A report as its next recordings need it.
struct Next {
  std::vector<Suggestion> suggestions;
  std::vector<Explored> explored;  ///< empty of reports that do not say it
};

/// From a report as JSON; throws nlohmann's exceptions where it is none.
std::vector<Suggestion> suggestions_of(const nlohmann::ordered_json& report);

/// From the text of a report.json; `source` stands for it in messages. Errors: not such a report
/// (kData).
core::Result<Next> suggest(std::string_view report_json, const std::string& source);

void to_json(nlohmann::ordered_json& json, const Suggestion& suggestion);
void to_json(nlohmann::ordered_json& json, const Explored& explored);

}  // namespace ravencal::diagnose
