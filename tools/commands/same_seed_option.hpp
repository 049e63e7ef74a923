// SPDX-License-Identifier: Apache-2.0
//
// --same-seed: figures of a test that is none (learn/shared_seeds.hpp).
#pragma once

#include <CLI/CLI.hpp>

namespace ravencal::commands {

inline void add_same_seed_option(CLI::App& command, bool& same_seed) {
  command.add_flag("--same-seed", same_seed,
                   "Test also on recordings of the digital twin that share a run seed with the "
                   "training, and so its random wander; the tables then say so");
}

}  // namespace ravencal::commands
