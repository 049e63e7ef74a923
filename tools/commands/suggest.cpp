// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "diagnose/suggest.hpp"

namespace ravencal::commands {
namespace {

struct Arguments {
  std::string report;
  bool json = false;
};

core::Status run(const Arguments& arguments) {
  std::ifstream file(arguments.report, std::ios::binary);
  if (!file) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be opened; give the report.json that `ravencal "
                                   "diagnose --out` wrote",
                                   arguments.report)};
  }
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  RAVENCAL_ASSIGN_OR_RETURN(const auto suggestions, diagnose::suggest(text, arguments.report));
  if (arguments.json) {
    fmt::print("{}\n", diagnose::suggestions_json(suggestions));
    return {};
  }
  if (suggestions.empty()) {
    fmt::print("Nothing to part and nothing untested: no further recording is worth making.\n");
    return {};
  }
  for (std::size_t i = 0; i < suggestions.size(); ++i) {
    const diagnose::Suggestion& s = suggestions[i];
    fmt::print("{}. {} ({:.0f} min)\n   {}\n", i + 1, s.experiment, s.minutes, s.why);
  }
  return {};
}

}  // namespace

void add_suggest(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("suggest", "Print the next recording worth making, from a diagnosis");
  command->add_option("report", arguments->report, "report.json of `ravencal diagnose`")
      ->required();
  command->add_flag("--json", arguments->json, "Print the suggestions as JSON");
  command->footer("Example: ravencal suggest diagnosis/report.json");
  on_call(*command, exit_code, [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
