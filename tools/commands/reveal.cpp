// SPDX-License-Identifier: Apache-2.0
#include "conceal/reveal.hpp"

#include <fmt/format.h>

#include <memory>

#include "cli/exit_code.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/whole_file.hpp"

namespace ravencal::commands {
namespace {

struct RevealArguments {
  std::string answer;
  std::string report;
  std::string json;
};

core::Status run(const RevealArguments& arguments, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string answer, core::read_whole_file(arguments.answer));
  RAVENCAL_ASSIGN_OR_RETURN(const std::string report, core::read_whole_file(arguments.report));
  RAVENCAL_ASSIGN_OR_RETURN(const conceal::Revealed revealed, conceal::reveal(answer, report));
  fmt::print("{}", conceal::reveal_table(revealed));
  if (!arguments.json.empty())
    RAVENCAL_RETURN_IF_ERROR(
        core::write_whole_file(arguments.json, conceal::reveal_json(revealed)));
  if (revealed.outcome != conceal::Outcome::kFound) exit_code = cli::kFinding;
  return {};
}

}  // namespace

void add_reveal(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RevealArguments>();
  CLI::App* command =
      app.add_subcommand("reveal", "What `conceal` hid against what `diagnose` found");
  command->add_option("answer", arguments->answer, "Answer of `conceal` (.json)")->required();
  command->add_option("report", arguments->report, "report.json of `diagnose`")->required();
  command->add_option("--json", arguments->json, "Write the comparison as JSON");
  command->footer(
      "Found is an effect with the right name at the right joint, and no other name. A name that\n"
      "the report does not tell apart from it is a look-alike and no hit. Exit code 1 if it was "
      "not\n"
      "found, or not alone.\n"
      "Example: ravencal reveal answer.json diagnosis/report.json");
  on_call(*command, exit_code, {.read = {"answer", "report"}, .written = {"--json"}},
          [arguments, &exit_code] { return run(*arguments, exit_code); });
}

}  // namespace ravencal::commands
