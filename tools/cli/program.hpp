// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace ravencal::cli {

/// Runs the body of a program and gives its exit code. What the body cannot know becomes a sentence
/// and kData: an exception, as of missing memory; a limit on the size of files (RLIMIT_FSIZE);
/// standard output that could not be written (core/terminal.hpp), as on a full disk, because what a
/// user was shown is then not whole. A reader of it that left has seen what it wanted.
int run_program(const char* name, const std::function<int()>& body);

}  // namespace ravencal::cli
