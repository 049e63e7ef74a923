// SPDX-License-Identifier: Apache-2.0
#include "monitor/monitor.hpp"

#include <memory>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"

namespace ravencal::commands {
namespace {

void report(const monitor::Options& options, const monitor::Outcome& outcome) {
  core::remark("{}: {} ticks seen, {} missed\n", outcome.name, outcome.ticks, outcome.missed);
  if (options.recording.empty()) return;
  core::remark("{}: {} rows\n", options.recording, outcome.rows);
  if (outcome.not_stored == 0) return;
  core::remark("{}: {} ticks not stored because the robot's time ran back\n", options.recording,
               outcome.not_stored);
}

}  // namespace

void add_monitor(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<monitor::Options>();
  CLI::App* command = app.add_subcommand("monitor", "Watch the plugin in a running controller");
  command->add_option("--name", options->name,
                      "Name of the telemetry, like /ravencal-left; default: the only one");
  command->add_option("--user", options->user,
                      "Trust the telemetry of this user, name or number, besides root's and yours");
  command->add_flag("--json", options->json, "For programs: one JSON object per line, SI units");
  command->add_option("--record", options->recording, "Store every tick in this recording (.db)");
  command->add_option("--duration-s", options->duration_s, "Stop after so long; default: Ctrl-C")
      ->check(CLI::Range(0.0, 1e7));
  command->add_option("--rate-hz", options->rate_hz, "Screens or JSON lines per second")
      ->check(CLI::Range(0.1, 50.0))
      ->capture_default_str();
  command->footer(
      "Reads only; the controller does not notice. monitor reports a controller that ends or dies\n"
      "and follows the next one of the same name. A loop without a tick for a second is "
      "\"stalled\".\n"
      "Without a terminal: one line per second.\n"
      "Example: ravencal monitor --name /ravencal-left --record evening.db");
  on_call(*command, exit_code, {.written = {"--record"}}, [options, &exit_code]() -> core::Status {
    cli::catch_interrupts();
    RAVENCAL_ASSIGN_OR_RETURN(const monitor::Outcome outcome,
                              monitor::run(*options, [] { return !cli::interrupted(); }));
    report(*options, outcome);
    if (outcome.ticks == 0) {
      core::remark("ravencal monitor: {}: not one tick; is the controller's loop running?\n",
                   outcome.name);
      exit_code = cli::kData;
    }
    return {};
  });
}

}  // namespace ravencal::commands
