// SPDX-License-Identifier: Apache-2.0
#include "cli/documentation.hpp"
#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/numbers.hpp"
#include "cli/program.hpp"
#include "cli/words.hpp"
#include "commands/commands.hpp"
#include "core/version.hpp"

namespace {

int run(int argc, char** argv) {
  namespace commands = ravencal::commands;
  int exit_code = ravencal::cli::kOk;
  ravencal::cli::end_cleanly_at_signals();
  CLI::App app{"ravencal: joint calibration for cable-driven surgical robots"};
  app.set_version_flag("--version", std::string("ravencal ") + ravencal::core::kVersion);
  app.require_subcommand(1);
  commands::add_trajectory(app, exit_code);
  commands::add_simulate(app, exit_code);
  commands::add_import(app, exit_code);
  commands::add_export(app, exit_code);
  commands::add_merge(app, exit_code);
  commands::add_info(app, exit_code);
  commands::add_train(app, exit_code);
  commands::add_evaluate(app, exit_code);
  commands::add_convert(app, exit_code);
  commands::add_sign(app, exit_code);
  commands::add_host(app, exit_code);
  commands::add_plant(app, exit_code);
  commands::add_profile(app, exit_code);
  commands::add_diagnose(app, exit_code);
  commands::add_suggest(app, exit_code);
  commands::add_prove(app, exit_code);
#ifdef RAVENCAL_ALL_COMMANDS
  commands::add_ablate(app, exit_code);
  commands::add_study(app, exit_code);
  commands::add_compare(app, exit_code);
  commands::add_recommend(app, exit_code);
  commands::add_run(app, exit_code);
  commands::add_robot(app, exit_code);
  commands::add_calibrate(app, exit_code);
  commands::add_monitor(app, exit_code);
  commands::add_control(app, exit_code);
  commands::add_rezero(app, exit_code);
#else
  app.footer(
      "This build lacks ablate, calibrate, compare, control, monitor, recommend, rezero, robot, "
      "run "
      "and study.\n"
      "`tools/run build` makes them.");
#endif
  ravencal::cli::check_numbers(app);
  ravencal::cli::add_documentation(app, "ravencal");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return ravencal::cli::explain(app, error);
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  return ravencal::cli::run_program("ravencal", [&] { return run(argc, argv); });
}
