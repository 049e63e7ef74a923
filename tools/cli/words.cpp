// SPDX-License-Identifier: Apache-2.0
#include "cli/words.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "cli/exit_code.hpp"
#include "core/known_words.hpp"

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
      fmt::print(stderr, "{}\n", text);
      return kUsage;
    }
  }
  return app.exit(error) == 0 ? kOk : kUsage;
}

}  // namespace ravencal::cli
