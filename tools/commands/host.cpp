// SPDX-License-Identifier: Apache-2.0
#include "commands/commands.hpp"

namespace ravencal::commands {

void add_host(CLI::App& /*app*/, int& /*exit_code*/) {}

}  // namespace ravencal::commands
