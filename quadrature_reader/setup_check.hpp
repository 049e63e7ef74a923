// SPDX-License-Identifier: Apache-2.0
//
// --check-setup: checks the set-up before a recording and reports each finding with its remedy.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "quadrature_reader/config.hpp"

namespace ravencal::quadrature_reader {

enum class Verdict : std::uint8_t { kGood, kWarning, kBad };

struct SetupFinding {
  Verdict verdict = Verdict::kGood;
  std::string text;  ///< what was looked at and found; for others than kGood with the remedy
};

struct SetupOptions {
  bool wiggle = false;     ///< ask for each joint to be moved by hand; needs somebody there
  double wiggle_s = 20.0;  ///< patience per joint
};

/// Looks at device files, permissions, real-time limits, line levels and CAN interfaces, then at
/// each joint's movement. `say` receives each finding; `stop` ends the check early. True: no
/// finding is bad.
bool check_setup(const Config& config, const SetupOptions& options,
                 const std::function<void(const SetupFinding&)>& say,
                 const std::function<bool()>& stop);

}  // namespace ravencal::quadrature_reader
