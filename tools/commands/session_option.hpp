// SPDX-License-Identifier: Apache-2.0
//
// --session: what has a constant of its own in the fit.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "choice/sessions.hpp"

namespace ravencal::commands {

inline void add_session_option(CLI::App& command, choice::SessionRule& sessions) {
  command
      .add_option("--session", sessions,
                  "What has a constant error of its own. auto: what follows an event homing or "
                  "rehoming, and each recording without one where that predicts other recordings "
                  "better; recording: each recording; none: nothing")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, choice::SessionRule>{{"auto", choice::SessionRule::kAuto},
                                                     {"recording", choice::SessionRule::kRecording},
                                                     {"none", choice::SessionRule::kNone}}));
}

}  // namespace ravencal::commands
