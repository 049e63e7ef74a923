// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "record/plausibility.hpp"

namespace ravencal::commands {

namespace {

std::string full_name(const CLI::App& command) {
  std::string name = command.get_name();
  for (const CLI::App* parent = command.get_parent();
       parent != nullptr && parent->get_parent() != nullptr; parent = parent->get_parent()) {
    name = parent->get_name() + " " + name;
  }
  return name;
}

core::Status run_together(const std::function<core::Status()>& run) {
  core::OutputGroup outputs;
  RAVENCAL_RETURN_IF_ERROR(run());
  return outputs.publish();
}

}  // namespace

void on_call(CLI::App& command, int& exit_code, FileOptions files,
             std::function<core::Status()> run) {
  cli::declare_files(command, files);
  command.callback([&command, &exit_code, files = std::move(files), run = std::move(run)] {
    core::Status status = cli::check_files(command, files);
    if (status.ok()) status = files.together ? run_together(run) : run();
    if (!status.ok()) {
      core::remark("ravencal {}: {}\n", full_name(command), status.error().message);
      exit_code = cli::exit_code_of(status.error().code);
    }
    if (const int interrupted = cli::exit_code_of_interrupt(); interrupted != 0) {
      core::remark("ravencal {}: interrupted\n", full_name(command));
      exit_code = interrupted;
    }
  });
}

std::vector<CLI::Option*> add_load_options(CLI::App& command, record::LoadOptions& load) {
  std::vector<CLI::Option*> options = add_range_options(command, load.range);
  options.push_back(command.add_option(
      "--profile", load.profile,
      "For a .csv or another table, which column is what: raven2, generic or a profile file"));
  options.push_back(command
                        .add_option("--arm", load.profile_options.arm,
                                    "Profile raven2: the arm with the external encoders")
                        ->check(CLI::IsMember({"gold", "green"}))
                        ->capture_default_str());
  options.push_back(add_skip_bad(command, load));
  return options;
}

CLI::Option* add_skip_bad(CLI::App& command, record::LoadOptions& load) {
  return command.add_flag("--skip-bad", load.skip_bad,
                          "Drop rows that cannot be read, with an event, instead of refusing the "
                          "file");
}

std::vector<CLI::Option*> add_range_options(CLI::App& command, record::TimeRange& range) {
  return {command
              .add_option("--from-s", range.from_s,
                          "Read each recording from this time on, s since its first row")
              ->check(cli::not_negative()),
          command
              .add_option("--to-s", range.to_s,
                          "Read each recording up to this time, s since its first row")
              ->check(cli::positive())};
}

void print_warnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) core::remark("ravencal: warning: {}\n", warning);
}

core::Result<std::vector<std::string>> warn_of_implausible(
    const std::vector<const record::Recording*>& recordings) {
  auto sentences = record::plausibility_warnings(recordings);
  if (sentences.ok()) print_warnings(*sentences);
  return sentences;
}

bool is_among(const std::string& path, const std::vector<std::string>& others) {
  return std::any_of(others.begin(), others.end(), [&](const std::string& other) {
    std::error_code unknown;
    return std::filesystem::equivalent(path, other, unknown);
  });
}

}  // namespace ravencal::commands
