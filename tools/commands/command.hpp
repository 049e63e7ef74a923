// SPDX-License-Identifier: Apache-2.0
//
// What the commands share: how they end, and the options of those that read recordings.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "cli/files.hpp"
#include "core/result.hpp"
#include "record/load.hpp"

namespace ravencal::commands {

using cli::FileOptions;

/// Declares the files of `command` and runs `run` when the user calls it, unless one of its outputs
/// cannot be one (cli::check_files). An error is printed as `ravencal COMMAND: why` and decides the
/// exit code (cli/exit_code.hpp), and so does a signal that cut the work short; success leaves it
/// as it is.
void on_call(CLI::App& command, int& exit_code, FileOptions files,
             std::function<core::Status()> run);

/// --profile and --arm, for what is not a recording yet, --skip-bad and the time range. Returns the
/// options.
std::vector<CLI::Option*> add_load_options(CLI::App& command, record::LoadOptions& load);

/// --skip-bad.
CLI::Option* add_skip_bad(CLI::App& command, record::LoadOptions& load);

/// --from-s and --to-s of every recording that the command reads.
std::vector<CLI::Option*> add_range_options(CLI::App& command, record::TimeRange& range);

void print_warnings(const std::vector<std::string>& warnings);

/// Warns of what a robot hardly did in these recordings. The sentences, for what is made of the
/// recordings. Error (kData): no robot did it.
core::Result<std::vector<std::string>> warn_of_implausible(
    const std::vector<const record::Recording*>& recordings);

/// True if that file is among them, by whatever path.
bool is_among(const std::string& path, const std::vector<std::string>& others);

}  // namespace ravencal::commands
