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

/// The command that was called, and its name behind the program's: "ravencal profile guess".
struct Called {
  const CLI::App* command;
  std::string name;
};

Called called_by(const CLI::App& app) {
  Called called{&app, std::filesystem::path(app.get_name()).filename().string()};
  for (auto below = app.get_subcommands(); !below.empty();
       below = called.command->get_subcommands()) {
    called.command = below.front();
    called.name += " " + called.command->get_name();
  }
  return called;
}

/// "there is no command 'gues'; did you mean ...", if that is what is wrong.
std::string unknown_command(const CLI::App& app, const CLI::App& called) {
  std::vector<std::string> known;
  for (const CLI::App* command : called.get_subcommands([](const CLI::App*) { return true; })) {
    if (!command->get_name().empty()) known.push_back(command->get_name());
  }
  if (known.empty()) return {};
  for (const std::string& word : app.remaining(true)) {
    if (word.starts_with('-')) continue;
    return fmt::format("there is no command '{}'{}", word, core::instead_of(word, known));
  }
  return {};
}

}  // namespace

int explain(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) {
    std::ostringstream help;
    (void)app.exit(error, help, help);
    core::say("{}", help.str());
    return kOk;
  }
  const Called called = called_by(app);
  std::string text;
  if (error.get_name() == "RequiredError" || error.get_name() == "ExtrasError")
    text = unknown_command(app, *called.command);
  if (text.empty())
    text = fmt::format("{}\n`{} --help` lists the options", error.what(), called.name);
  core::remark("{}: {}\n", called.name, text);
  return kUsage;
}

}  // namespace ravencal::cli
