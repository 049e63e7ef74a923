// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "cli/exit_code.hpp"

namespace ravencal::commands {

void on_call(CLI::App& command, int& exit_code, std::function<core::Status()> run) {
  command.callback([&command, &exit_code, run = std::move(run)] {
    const core::Status status = run();
    if (status.ok()) return;
    std::string name = command.get_name();
    for (CLI::App* parent = command.get_parent();
         parent != nullptr && parent->get_parent() != nullptr; parent = parent->get_parent()) {
      name = parent->get_name() + " " + name;
    }
    fmt::print(stderr, "ravencal {}: {}\n", name, status.error().message);
    exit_code = cli::exit_code_of(status.error().code);
  });
}

void add_load_options(CLI::App& command, record::LoadOptions& load) {
  command.add_option("--profile", load.profile,
                     "For a .csv, which column is what: raven2, generic or a profile file");
  command
      .add_option("--arm", load.profile_options.arm,
                  "Profile raven2: the arm with the external encoders")
      ->check(CLI::IsMember({"gold", "green"}))
      ->capture_default_str();
  command.add_flag("--skip-bad", load.skip_bad,
                   "For a .csv: drop rows that cannot be read, each with an event");
}

core::Result<std::vector<record::Recording>> load_recordings(const std::vector<std::string>& paths,
                                                             const record::LoadOptions& load) {
  std::vector<record::Recording> recordings;
  for (const std::string& path : paths) {
    RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording, record::load_recording(path, load));
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

bool is_among(const std::string& path, const std::vector<std::string>& others) {
  return std::any_of(others.begin(), others.end(), [&](const std::string& other) {
    std::error_code unknown;
    return std::filesystem::equivalent(path, other, unknown);
  });
}

std::vector<const record::Recording*> pointers_to(
    const std::vector<record::Recording>& recordings) {
  std::vector<const record::Recording*> result;
  result.reserve(recordings.size());
  for (const record::Recording& recording : recordings) result.push_back(&recording);
  return result;
}

}  // namespace ravencal::commands
