// SPDX-License-Identifier: Apache-2.0
#include "conversion/convert.hpp"

#include <memory>

#include "cli/exit_code.hpp"
#include "cli/numbers.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/origin_options.hpp"
#include "core/terminal.hpp"

namespace ravencal::commands {
namespace {

core::Status run(const conversion::Request& request, bool json, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const conversion::Outcome outcome, conversion::convert(request));
  core::say("{}", json ? to_json(request, outcome) : describe(request, outcome));
  if (!outcome.accepted) exit_code = cli::kFinding;
  return {};
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<conversion::Request>();
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("convert", "Convert a model into weights for the plugin");
  command
      ->add_option("model", arguments->model,
                   "Model of `ravencal train` (.onnx), of Keras (.h5), or of "
                   "PyTorch or TensorFlow (.onnx)")
      ->required();
  command->add_option(
      "--scaling", arguments->scaling,
      "Model of another program: its inputs, outputs, units and scaling (.json, .npz)");
  command->add_option("--out", arguments->out, "Weights to write (.blob)")->required();
  command->add_option("--precision", arguments->precision, "Precision of the weights")
      ->check(CLI::IsMember({"f32", "bf16", "int8"}))
      ->capture_default_str();
  CLI::Option* compact = command->add_option(
      "--compact", arguments->budget,
      "Remove inputs and units that change nothing; with a budget such as 0.02, also those whose "
      "removal changes the outputs by less than that share of their spread");
  compact->expected(0, 1)->check(CLI::Range(0.0, 1.0));
  command->add_option("--calibrate", arguments->calibrate,
                      "Recordings of the training. int8 and --compact need them (default: that of "
                      "--check), so does the trained range of a model of another program, and so "
                      "do the gains of the loop that torque, velocity and desired positions close");
  command->add_option("--plant", arguments->plant,
                      "Plant (.toml) with the servo of the loop: refuse (exit 1) a gain margin "
                      "below 2 or a phase margin below 45 deg");
  command->add_flag("--unbounded-loop", arguments->unbounded_loop,
                    "Write weights although the gains of the loop are unknown or its margins too "
                    "small; the arm may oscillate");
  command->add_option(
      "--check", arguments->check,
      "Recording on which to compare the weights with the model; refuse (exit 1) a model "
      "that makes a joint's error larger there than no correction does");
  command
      ->add_option("--max-rmse-change", arguments->max_rmse_change_percent,
                   "Refuse (exit 1) weights that raise a joint's RMSE by more than this, percent")
      ->check(cli::not_negative())
      ->capture_default_str();
  command->add_flag("--json", *json, "Print JSON");
  (void)add_load_options(*command, arguments->load);
  auto origin = std::make_shared<OriginOptions>();
  add_origin_options(*command, *origin);
  command->footer(
      "Examples:\n"
      "  ravencal convert model.onnx --out weights.blob --check test.db\n"
      "  ravencal convert model.onnx --out weights.blob --precision int8 --compact 0.02 "
      "--calibrate train*.db --check test.db\n"
      "  ravencal convert model.onnx --out weights.blob --calibrate train*.db --plant raven2.toml\n"
      "  ravencal convert model.h5 --scaling scaling.json --calibrate train*.db --out weights.blob "
      "--check test.db");
  on_call(*command, exit_code,
          {.read = {"model", "--scaling", "--calibrate", "--plant", "--check", "--profile"},
           .written = {"--out"}},
          [arguments, command, origin, compact, json, &exit_code] {
            arguments->origin = given_origin(*command, *origin);
            arguments->compact = compact->count() > 0;
            return run(*arguments, *json, exit_code);
          });
}

}  // namespace ravencal::commands
