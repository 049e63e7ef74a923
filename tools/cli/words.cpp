// SPDX-License-Identifier: Apache-2.0
#include "cli/words.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <sstream>

#include "cli/exit_code.hpp"
#include "core/known_words.hpp"
#include "core/terminal.hpp"

namespace ravencal::cli {
namespace {

/// "ravencal profile: there is no command 'gues'; did you mean ...", if that is what is wrong.
std::string unknown_command(const CLI::App& app) {
  const CLI::App* at = &app;
  std::string name = std::filesystem::path(app.get_name()).filename().string();
  for (auto called = at->get_subcommands(); !called.empty(); called = at->get_subcommands()) {
    at = called.front();
    name += " " + at->get_name();
  }
  std::vector<std::string> known;
  for (const CLI::App* command : at->get_subcommands([](const CLI::App*) { return true; })) {
    if (!command->get_name().empty()) known.push_back(command->get_name());
  }
  if (known.empty()) return {};
  for (const std::string& word : app.remaining(true)) {
    if (word.starts_with('-')) continue;
    return fmt::format("{}: there is no command '{}'{}", name, word, core::instead_of(word, known));
  }
  return {};
}

}  // namespace

int explain(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_name() == "RequiredError" || error.get_name() == "ExtrasError") {
    if (const std::string text = unknown_command(app); !text.empty()) {
      core::remark("{}\n", text);
      return kUsage;
    }
  }
  std::ostringstream result;
  std::ostringstream remarks;
  const bool is_help = app.exit(error, result, remarks) == 0;
  core::say("{}", result.str());
  core::remark("{}", remarks.str());
  return is_help ? kOk : kUsage;
}

}  // namespace ravencal::cli
