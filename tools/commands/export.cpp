// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "exchange/hdf5_export.hpp"
#include "exchange/load.hpp"
#include "exchange/mat_export.hpp"
#include "record/bag_load.hpp"
#include "record/csv_export.hpp"

namespace ravencal::commands {
namespace {

struct ExportArguments {
  std::string recording;
  std::string profile;
  std::string out;
  record::LoadOptions load;
};

/// In the columns of a profile.
core::Status export_profile(const ExportArguments& arguments, const record::Recording& recording,
                            const std::string& extension) {
  // The recording knows which arm it calibrates; that half of the two-arm columns it fills.
  record::ProfileOptions options;
  const auto arm = recording.meta.find("arm");
  if (arm != recording.meta.end()) options.arm = arm->second;
  const std::string by_default = extension == ".bag" ? "raven2-bag" : "generic";
  RAVENCAL_ASSIGN_OR_RETURN(
      const record::Profile profile,
      record::load_profile(arguments.profile.empty() ? by_default : arguments.profile, options));
  if ("." + profile.format != extension) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: profile {} writes .{} files", arguments.out, profile.name,
                                   profile.format)};
  }
  return extension == ".bag" ? record::export_bag(recording, profile, arguments.out)
                             : record::export_csv(recording, profile, arguments.out);
}

/// The profile that a generic table gets.
cli::Paths profile_beside(const CLI::App& command) {
  const std::filesystem::path out = cli::path_of(command, "--out");
  const std::filesystem::path profile = cli::path_of(command, "--profile");
  const bool is_generic = profile.empty() || profile == "generic";
  if (out.extension() != ".csv" || !is_generic) return {};
  return {record::profile_beside(out)};
}

core::Status run(const ExportArguments& arguments) {
  const std::string extension = std::filesystem::path(arguments.out).extension().string();
  const bool has_profile = extension == ".csv" || extension == ".bag";
  if (!has_profile && extension != ".h5" && extension != ".mat") {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format("{}: the name must end in .csv, .bag, .h5 or .mat", arguments.out)};
  }
  if (!has_profile && !arguments.profile.empty()) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: {} files hold every channel and need no --profile",
                                   arguments.out, extension)};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            exchange::load_recording(arguments.recording, arguments.load));
  RAVENCAL_RETURN_IF_ERROR(has_profile          ? export_profile(arguments, recording, extension)
                           : extension == ".h5" ? exchange::export_hdf5(recording, arguments.out)
                                                : exchange::export_mat(recording, arguments.out));
  core::say("{}: {} rows\n", arguments.out, recording.rows());
  return {};
}

}  // namespace

void add_export(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command =
      app.add_subcommand("export", "Write a recording for other programs: CSV, bag, HDF5, MAT");
  command->add_option("recording", arguments->recording, "Recording to read (.db)")->required();
  command->add_option(
      "--profile", arguments->profile,
      ".csv, .bag: which column is what: raven2 (252 columns), raven2-bag, generic (a "
      "header, every channel; OUT.toml beside it keeps roles, metadata and events for `import`) or "
      "a profile file; default generic, raven2-bag");
  command->add_option("--out", arguments->out, "File to write (.csv, .bag, .h5 or .mat)")
      ->required();
  (void)add_range_options(*command, arguments->load.range);
  add_skip_bad(*command, arguments->load);
  command->add_flag("--force,--overwrite")->description("Replace a file of that name");
  command->footer(
      "Examples: ravencal export run3.db --profile raven2 --out run3.csv\n"
      "          ravencal export run3.db --out run3.csv      (PlotJuggler, spreadsheets)\n"
      "          ravencal export run3.db --out run3.mat      (or run3.h5, run3.bag)");
  const FileOptions files = {.read = {"recording", "--profile"},
                             .written = {"--out"},
                             .also_written = profile_beside,
                             .together = true};
  on_call(*command, exit_code, files, [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
