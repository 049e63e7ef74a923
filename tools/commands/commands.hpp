// SPDX-License-Identifier: Apache-2.0
//
// One function per command of `ravencal`: it declares the arguments and wires them to a library.
// A command's callback returns by setting `exit_code` (cli/exit_code.hpp).
#pragma once

#include <CLI/CLI.hpp>

namespace ravencal::commands {

void add_trajectory(CLI::App& app, int& exit_code);
void add_simulate(CLI::App& app, int& exit_code);
void add_import(CLI::App& app, int& exit_code);
void add_export(CLI::App& app, int& exit_code);
void add_merge(CLI::App& app, int& exit_code);
void add_info(CLI::App& app, int& exit_code);
void add_train(CLI::App& app, int& exit_code);
void add_evaluate(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_sign(CLI::App& app, int& exit_code);
void add_host(CLI::App& app, int& exit_code);
void add_monitor(CLI::App& app, int& exit_code);
void add_control(CLI::App& app, int& exit_code);
void add_rezero(CLI::App& app, int& exit_code);
void add_diagnose(CLI::App& app, int& exit_code);
void add_plant(CLI::App& app, int& exit_code);
void add_profile(CLI::App& app, int& exit_code);
void add_suggest(CLI::App& app, int& exit_code);
void add_prove(CLI::App& app, int& exit_code);
void add_run(CLI::App& app, int& exit_code);
void add_robot(CLI::App& app, int& exit_code);
void add_calibrate(CLI::App& app, int& exit_code);
void add_ablate(CLI::App& app, int& exit_code);
void add_study(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_recommend(CLI::App& app, int& exit_code);

}  // namespace ravencal::commands
