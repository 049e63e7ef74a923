// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::cli {

/// Catches Ctrl-C and SIGTERM from here on: the first sets interrupted(), so that long work can
/// stop at a good place and leave valid files; the second ends the process at once.
void catch_interrupts();

/// True once the user asked to stop.
bool interrupted();

}  // namespace ravencal::cli
