// SPDX-License-Identifier: Apache-2.0
#include "cli/files.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "core/output_place.hpp"
#include "core/outputs.hpp"

namespace ravencal::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kForce = "--force";

void name_kind(CLI::App& command, const std::vector<std::string>& options, const char* kind) {
  for (const std::string& option : options) command.get_option(option)->type_name(kind);
}

Paths paths_of(const CLI::App& command, const std::vector<std::string>& options) {
  Paths paths;
  for (const std::string& name : options) {
    const CLI::Option* const option = command.get_option(name);
    for (const std::string& path : option->results()) paths.emplace_back(path);
    if (option->results().empty()) paths.emplace_back(option->get_default_str());
  }
  // An empty path is none.
  paths.erase(std::remove(paths.begin(), paths.end(), fs::path()), paths.end());
  return paths;
}

core::Status check_folder_of(const fs::path& output) {
  const core::OutputPlace place = core::output_place(output);
  if (place.kind != core::OutputPlace::Kind::kNewFile) return {};
  std::error_code unknown;
  const fs::path folder = fs::absolute(place.path, unknown).parent_path();
  if (fs::is_directory(folder, unknown)) return {};
  return core::io_error(fmt::format("{}: there is no folder {}", output.string(), folder.string()));
}

core::Status check_output_folder(const fs::path& path) {
  std::error_code unknown;
  if (fs::is_directory(path, unknown) || !fs::exists(fs::symlink_status(path, unknown))) return {};
  return core::usage_error(fmt::format("{}: is not a folder; choose another name", path.string()));
}

/// The same file in the end, if it were created now.
bool are_one(const fs::path& a, const fs::path& b) {
  std::error_code unknown;
  const auto real = [&](const fs::path& path) {
    return fs::weakly_canonical(fs::absolute(path, unknown), unknown);
  };
  return real(a) == real(b);
}

core::Status check_distinct(const Paths& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (core::output_place(outputs[i]).is_stream()) continue;
    for (std::size_t k = 0; k < i; ++k) {
      if (!are_one(outputs[k], outputs[i])) continue;
      return core::usage_error(
          fmt::format("{}: two outputs have this name; give each its own", outputs[i].string()));
    }
  }
  return {};
}

/// A script's variable without a value, most likely.
core::Status check_named(const CLI::App& command, const std::vector<std::string>& options) {
  for (const std::string& name : options) {
    for (const std::string& path : command.get_option(name)->results()) {
      if (path.empty()) return core::usage_error(fmt::format("{}: an empty name is no file", name));
    }
  }
  return {};
}

bool is_forced(const CLI::App& command, const FileOptions& files) {
  const CLI::Option* const force = command.get_option_no_throw(kForce);
  return !files.can_force || (force != nullptr && force->count() > 0);
}

void list_options(const CLI::App& app, const std::string& name, std::string& text) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string kind = option->get_type_name();
    const bool is_word = kind.find('{') != std::string::npos || option->get_group().empty();
    const bool is_text = kind.starts_with("TEXT") || kind.starts_with(kReadFile) ||
                         kind.starts_with(kNewFile) || kind.starts_with(kChangedFile) ||
                         kind.starts_with(kOutputFolder);
    if (is_word || !is_text) continue;
    text += fmt::format("{}\t{}\t{}\n", name, option->get_name(), kind.substr(0, kind.find(' ')));
  }
  for (const CLI::App* below : app.get_subcommands({})) {  // or a group of options, without a name
    const bool is_group = below->get_name().empty();
    list_options(*below, is_group ? name : name + " " + below->get_name(), text);
  }
}

}  // namespace

void declare_files(CLI::App& command, const FileOptions& files) {
  name_kind(command, files.read, kReadFile);
  name_kind(command, files.written, kNewFile);
  name_kind(command, files.changed, kChangedFile);
  name_kind(command, files.folders, kOutputFolder);
  const bool writes = !files.written.empty() || !files.folders.empty();
  if (!writes || !files.can_force || command.get_option_no_throw(kForce) != nullptr) return;
  command.add_flag(kForce)->description("Replace files that exist");
}

core::Status check_files(const CLI::App& command, const FileOptions& files) {
  for (const auto* options : {&files.read, &files.written, &files.changed, &files.folders})
    RAVENCAL_RETURN_IF_ERROR(check_named(command, *options));
  core::protect_inputs(paths_of(command, files.read));
  const Paths changed = paths_of(command, files.changed);
  if (!is_forced(command, files)) core::protect_existing();
  for (const fs::path& path : changed) core::may_renew(path);
  if (files.own) {
    for (const fs::path& path : files.own(command)) core::may_renew(path);
  }
  Paths outputs = paths_of(command, files.written);
  for (const fs::path& path : outputs) RAVENCAL_RETURN_IF_ERROR(check_folder_of(path));
  for (const fs::path& path : paths_of(command, files.folders))
    RAVENCAL_RETURN_IF_ERROR(check_output_folder(path));
  outputs.insert(outputs.end(), changed.begin(), changed.end());
  if (files.also_written) {
    for (const fs::path& path : files.also_written(command)) outputs.push_back(path);
  }
  for (const fs::path& path : outputs) RAVENCAL_RETURN_IF_ERROR(core::check_output(path));
  return check_distinct(outputs);
}

fs::path path_of(const CLI::App& command, const std::string& option) {
  const Paths paths = paths_of(command, {option});
  return paths.empty() ? fs::path() : paths.front();
}

bool is_record_of_run(const fs::path& file, const std::vector<std::string>& keys) {
  std::ifstream stream(file);
  const auto json = nlohmann::json::parse(stream, nullptr, false);
  return json.is_object() && std::all_of(keys.begin(), keys.end(), [&](const std::string& key) {
           return json.contains(key);
         });
}

std::string list_of_files(const CLI::App& app, const std::string& program) {
  std::string text;
  list_options(app, program, text);
  return text;
}

}  // namespace ravencal::cli
