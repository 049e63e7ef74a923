// SPDX-License-Identifier: Apache-2.0
//
// --session: what has a constant of its own in the fit.
#pragma once

#include <CLI/CLI.hpp>

#include "choice/sessions.hpp"
#include "cli/words.hpp"

namespace ravencal::commands {

inline void add_session_option(CLI::App& command, choice::SessionRule& sessions) {
  cli::add_words<choice::SessionRule>(
      command, "--session", sessions,
      {{"auto", choice::SessionRule::kAuto},
       {"recording", choice::SessionRule::kRecording},
       {"none", choice::SessionRule::kNone}},
      "What has a constant error of its own. auto: what follows an event homing or rehoming, and "
      "each recording without one where that predicts other recordings better; recording: each "
      "recording; none: nothing");
}

}  // namespace ravencal::commands
