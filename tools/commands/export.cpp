// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "record/bag_load.hpp"
#include "record/csv_export.hpp"
#include "record/load.hpp"

namespace ravencal::commands {
namespace {

struct Arguments {
  std::string recording;
  std::string profile;
  std::string out;
};

core::Status run(const Arguments& arguments) {
  const std::string extension = std::filesystem::path(arguments.out).extension().string();
  if (extension != ".csv" && extension != ".bag") {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: the name must end in .csv or .bag", arguments.out)};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            record::load_recording(arguments.recording, {}));
  // The recording knows which arm it calibrates; that half of the two-arm columns it fills.
  record::ProfileOptions options;
  const auto arm = recording.meta.find("arm");
  if (arm != recording.meta.end()) options.arm = arm->second;
  RAVENCAL_ASSIGN_OR_RETURN(const record::Profile profile,
                            record::load_profile(arguments.profile, options));
  if ("." + profile.format != extension) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: profile {} writes .{} files", arguments.out, profile.name,
                                   profile.format)};
  }
  RAVENCAL_RETURN_IF_ERROR(extension == ".bag"
                               ? record::export_bag(recording, profile, arguments.out)
                               : record::export_csv(recording, profile, arguments.out));
  fmt::print("{}: {} rows\n", arguments.out, recording.rows());
  return {};
}

}  // namespace

void add_export(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("export", "Write a recording as the file of a profile");
  command->add_option("recording", arguments->recording, "Recording to read (.db)")->required();
  command
      ->add_option("--profile", arguments->profile,
                   "Which column is what: raven2, raven2-bag, generic or a profile file")
      ->required();
  command->add_option("--out", arguments->out, "File to write (.csv or .bag)")->required();
  command->footer(
      "Examples: ravencal export run3.db --profile raven2 --out run3.csv\n"
      "          ravencal export run3.db --profile raven2-bag --out run3.bag");
  on_call(*command, exit_code, [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
