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
#include "core/outputs.hpp"
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

std::vector<std::filesystem::path> paths_of(const CLI::App& command,
                                            const std::vector<std::string>& options) {
  std::vector<std::filesystem::path> paths;
  for (const std::string& option : options) {
    for (const std::string& path : command.get_option(option)->results()) paths.emplace_back(path);
  }
  return paths;
}

/// The same file in the end, if it were created now.
bool are_one(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code unknown;
  const auto real = [&](const std::filesystem::path& path) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path, unknown), unknown);
  };
  return real(a) == real(b);
}

core::Status check_files(const CLI::App& command, const FileOptions& files) {
  core::protect_inputs(paths_of(command, files.read));
  const std::vector<std::filesystem::path> written = paths_of(command, files.written);
  for (std::size_t i = 0; i < written.size(); ++i) {
    RAVENCAL_RETURN_IF_ERROR(core::check_output(written[i]));
    std::error_code unknown;
    const bool may_take_both = std::filesystem::exists(written[i], unknown) &&
                               !std::filesystem::is_regular_file(written[i], unknown);
    for (std::size_t k = 0; k < i && !may_take_both; ++k) {
      if (are_one(written[k], written[i])) {
        return core::usage_error(
            fmt::format("{}: two outputs have this name; give each its own", written[i].string()));
      }
    }
  }
  return {};
}

}  // namespace

void on_call(CLI::App& command, int& exit_code, FileOptions files,
             std::function<core::Status()> run) {
  command.callback([&command, &exit_code, files = std::move(files), run = std::move(run)] {
    core::Status status = check_files(command, files);
    if (status.ok()) status = run();
    if (!status.ok()) {
      fmt::print(stderr, "ravencal {}: {}\n", full_name(command), status.error().message);
      exit_code = cli::exit_code_of(status.error().code);
    }
    if (const int interrupted = cli::exit_code_of_interrupt(); interrupted != 0) {
      fmt::print(stderr, "ravencal {}: interrupted\n", full_name(command));
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
  for (const std::string& warning : warnings)
    fmt::print(stderr, "ravencal: warning: {}\n", warning);
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
