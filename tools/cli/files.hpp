// SPDX-License-Identifier: Apache-2.0
//
// The options of a command that name files. A command declares each as read or written; its help,
// --list-files and the check before its work follow from that.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace CLI {
class App;
}

namespace ravencal::cli {

using Paths = std::vector<std::filesystem::path>;
/// Paths that follow from what the user gave the command.
using PathsOf = std::function<Paths(const CLI::App&)>;

/// What an option's value is; it stands in the help in the place of TEXT.
inline constexpr const char* kReadFile = "FILE";         ///< or a folder whose files are read
inline constexpr const char* kNewFile = "NEW-FILE";      ///< made whole under a name that is free
inline constexpr const char* kChangedFile = "OWN-FILE";  ///< read and written in place
inline constexpr const char* kOutputFolder = "FOLDER";   ///< written into

/// Names of options and positionals, by what happens to the files that they name.
struct FileOptions {
  std::vector<std::string> read{};
  std::vector<std::string> written{};
  std::vector<std::string> changed{};
  std::vector<std::string> folders{};
  /// Files that are written and that no option names: in folders, beside others.
  PathsOf also_written{};
  /// Results of this command, recognised by their content, that it may replace without --force.
  PathsOf own{};
  /// All outputs appear together or not at all. Not for what is written bit by bit.
  bool together = false;
  /// --force replaces what is there.
  bool can_force = true;
};

/// Gives the options their kinds in the help, and --force to a command that writes. Call it when
/// they are all there.
void declare_files(CLI::App& command, const FileOptions& files);

/// Before the work of a parsed command: protects what it reads and, without --force, what is there.
/// Errors: an output that cannot be one, as of core::check_output; its folder is missing (kIo); two
/// outputs of one name, or an empty name (kUsage).
core::Status check_files(const CLI::App& command, const FileOptions& files);

/// The path that the option has, by default too; empty where it has none.
std::filesystem::path path_of(const CLI::App& command, const std::string& option);

/// True for a JSON object with these keys, by which the folder of an earlier run is known.
bool is_record_of_run(const std::filesystem::path& file, const std::vector<std::string>& keys);

/// All commands below `app` with their options for text, for tests: lines of command, option and
/// kind, parted by tabs.
std::string list_of_files(const CLI::App& app, const std::string& program);

}  // namespace ravencal::cli
