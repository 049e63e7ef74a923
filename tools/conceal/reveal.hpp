// SPDX-License-Identifier: Apache-2.0
//
// What was hidden against what a diagnosis found. Reads the two files, knows neither program.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::conceal {

/// One effect, as told by either file.
struct Told {
  std::string joint, id, from;
  std::string parameter, unit;  ///< the one that was drawn; empty: not told
  double value = 0.0;
  std::optional<std::pair<double, double>> ci95;
};

/// RMS on the held-out motion.
struct HeldOutError {
  double before = 0.0, after = 0.0;
  std::string unit;
};

enum class Outcome {
  kFound,        ///< joint and effect are right, and nothing else is named
  kFoundBeside,  ///< joint and effect are right, beside names of what was not hidden
  kLookAlike,    ///< named by another effect, which the report does not tell apart from it
  kMissed,
};
std::string_view word_of(Outcome outcome);

struct Revealed {
  Told hidden;
  double scatters = 0.0;
  std::string shows_in;
  Outcome outcome = Outcome::kMissed;
  std::optional<Told> found;                ///< what the report has in its place
  std::optional<HeldOutError> error;        ///< of what it found; else of the joint
  std::vector<std::string> not_told_apart;  ///< ids
  std::vector<std::pair<std::string, std::string>> also_named;  ///< joint and id
  std::string verdict;
};

/// `answer` as `conceal` wrote it, `report` as `diagnose` did. Errors: kData.
core::Result<Revealed> reveal(const std::string& answer, const std::string& report);

/// Two lines, what was hidden and what was found, and one that judges.
std::string reveal_table(const Revealed& revealed);
std::string reveal_json(const Revealed& revealed);

}  // namespace ravencal::conceal
