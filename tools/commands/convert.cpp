// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "cli/exit_code.hpp"
#include "cli/numbers.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "commands/convert.hpp"
#include "commands/origin_options.hpp"
#include "conversion/assemble.hpp"
#include "conversion/kernel_check.hpp"
#include "conversion/window.hpp"
#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "exchange/load.hpp"
#include "learn/file_hash.hpp"
#include "learn/onnx_file.hpp"
#include "learn/recording_origin.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "model/compact.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::commands {

using convert::Arguments;
using convert::Foreign;
using convert::Outcome;

std::vector<std::string> convert::calibration_files(const Arguments& arguments) {
  if (!arguments.calibrate.empty() || arguments.check.empty()) return arguments.calibrate;
  return {arguments.check};
}

std::size_t convert::bytes_per_step(const std::vector<std::byte>& blob) {
  model::BlobView view;
  return model::BlobView::open(blob, view).ok() ? view.bytes_per_step() : 0;
}

bool convert::is_exact(const Arguments& arguments) {
  return arguments.precision == "f32" && arguments.budget == 0.0;
}

namespace {

/// Rows of these recordings without a lost value; `model` needs its features and row period only.
core::Result<model::FeatureMatrix> rows_of(const std::vector<record::Recording>& recordings,
                                           const model::CalibrationModel& model) {
  model::FeatureMatrix rows(0, static_cast<Eigen::Index>(model.features.size()));
  for (const record::Recording& recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix features,
                              model::feature_matrix(model.features, recording, model.row_period_s));
    convert::append_whole_rows(features, rows);
  }
  return rows;
}

/// Fills in the model, whoever trained it.
core::Status read_model(const Arguments& arguments, Outcome& outcome) {
  const std::string extension = std::filesystem::path(arguments.model).extension().string();
  const bool is_onnx = extension == ".onnx";
  if (!is_onnx && extension != ".h5" && extension != ".hdf5") {
    return core::usage_error(fmt::format(
        "{}: unknown kind of model; .onnx and .h5 are read{}", arguments.model,
        extension == ".keras" ? " (Keras writes one by model.save(\"model.h5\"))" : ""));
  }
  if (is_onnx) {
    RAVENCAL_ASSIGN_OR_RETURN(const bool is_own, learn::is_ravencal_onnx(arguments.model));
    if (is_own && !arguments.scaling.empty()) {
      return core::usage_error(
          fmt::format("{}: contains its scaling; leave out --scaling", arguments.model));
    }
    if (is_own) {
      RAVENCAL_ASSIGN_OR_RETURN(outcome.model, learn::read_onnx(arguments.model));
      return {};
    }
  }
  if (arguments.scaling.empty()) {
    return core::usage_error(
        fmt::format("{}: was not trained by ravencal: --scaling FILE must say what its "
                    "inputs and outputs are (JSON or .npz)",
                    arguments.model));
  }
  Foreign foreign;
  RAVENCAL_ASSIGN_OR_RETURN(foreign.scaling, conversion::read_scaling_file(arguments.scaling));
  RAVENCAL_ASSIGN_OR_RETURN(foreign.model, is_onnx ? conversion::read_foreign_onnx(arguments.model)
                                                   : conversion::read_keras(arguments.model));
  model::CalibrationModel described;
  described.features = foreign.scaling.features;
  described.row_period_s = foreign.scaling.row_period_s;
  model::FeatureMatrix rows;
  if (!arguments.calibrate.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(rows, rows_of(outcome.calibrate, described));
  }
  auto model = conversion::assemble(foreign.model, foreign.scaling, rows);
  if (!model.ok()) {
    return core::Error{model.error().code,
                       fmt::format("{}: {}", arguments.model, model.error().message)};
  }
  outcome.model = std::move(*model);
  RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, learn::sha256_of_file(arguments.model));
  outcome.model.provenance["source"] =
      fmt::format("{} sha256:{}", std::filesystem::path(arguments.model).filename().string(), hash);
  outcome.foreign = std::move(foreign);
  return {};
}

/// Weights are for the plugin, which reads the robot state of a RAVEN-II and corrects its joints 1
/// to 3: what no plugin can load is said before anything is converted.
core::Status check_loadable(const std::string& file, const model::CalibrationModel& model) {
  const auto refuse = [&](const std::string& why) {
    return core::usage_error(fmt::format(
        "{}: {}; weights are for the plugin of a RAVEN-II. Any ONNX runtime runs a model of "
        "`ravencal train` as it is: its input and output are described in shared/FORMATS.md",
        file, why));
  };
  const auto joints = std::span(core::kSlotNames).first(core::kCalibratedJointCount);
  for (const model::OutputSpec& output : model.outputs) {
    if (std::find(joints.begin(), joints.end(), output.joint) == joints.end())
      return refuse(fmt::format("it corrects '{}', and a plugin corrects {}", output.joint,
                                fmt::join(joints, ", ")));
  }
  std::vector<std::string> unknown;
  for (const model::FeatureSpec& feature : model.features) {
    const bool is_listed =
        std::find(unknown.begin(), unknown.end(), feature.channel) != unknown.end();
    if (!core::catalogue_index_of(feature.channel) && !is_listed)
      unknown.push_back(feature.channel);
  }
  if (unknown.empty()) return {};
  return refuse(fmt::format("no robot state has its inputs {}", fmt::join(unknown, ", ")));
}

/// Joins what the model, the options and the recordings of the training say of its origin.
core::Status complete_origin(const Arguments& arguments, Outcome& outcome) {
  model::Origin& origin = outcome.model.origin;
  RAVENCAL_ASSIGN_OR_RETURN(
      origin, model::joined(origin, arguments.origin,
                            "--arm, --robot, --controller, --coordinates against the model"));
  RAVENCAL_ASSIGN_OR_RETURN(origin, learn::common_origin(origin, pointers_to(outcome.calibrate)));
  return {};
}

core::Status make_blob(const Arguments& arguments, Outcome& outcome) {
  model::Packing packing;
  RAVENCAL_ASSIGN_OR_RETURN(packing.precision, model::precision_of(arguments.precision));
  const bool is_int8 = packing.precision == model::packed::Precision::kInt8;
  const bool needs_rows = is_int8 || (arguments.compact && arguments.budget > 0.0);
  if (needs_rows && convert::calibration_files(arguments).empty()) {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format(
            "{} needs recordings of the training: give them with --calibrate (or one with --check)",
            is_int8 ? "--precision int8" : "--compact with a budget")};
  }
  model::FeatureMatrix rows;
  if (is_int8 || arguments.compact) {
    std::vector<record::Recording> checked;
    if (outcome.calibrate.empty()) {
      RAVENCAL_ASSIGN_OR_RETURN(
          checked, load_recordings(convert::calibration_files(arguments), arguments.load));
    }
    RAVENCAL_ASSIGN_OR_RETURN(
        rows, rows_of(outcome.calibrate.empty() ? checked : outcome.calibrate, outcome.model));
    outcome.calibration_rows = rows.rows();
  }
  if (arguments.compact) {
    if (conversion::window_of(outcome.model) > 1) {
      return core::usage_error(
          fmt::format("{}: --compact cannot make a network with a GRU smaller; leave it out, "
                      "or train one with fewer units",
                      arguments.model));
    }
    RAVENCAL_ASSIGN_OR_RETURN(outcome.compacted,
                              model::compact(outcome.model, rows, {arguments.budget}));
    outcome.compacted.model.provenance["compacted"] =
        fmt::format("{} of {} weights, budget {}, outputs change by {:.4g} of their spread",
                    outcome.compacted.weights_after, outcome.compacted.weights_before,
                    arguments.budget, outcome.compacted.output_change);
  } else {
    outcome.compacted.model = outcome.model;
    outcome.compacted.kept_inputs.resize(outcome.model.features.size());
    std::iota(outcome.compacted.kept_inputs.begin(), outcome.compacted.kept_inputs.end(),
              std::size_t{0});
  }
  if (is_int8) {
    const model::FeatureMatrix kept =
        arguments.compact ? model::FeatureMatrix(rows(Eigen::all, outcome.compacted.kept_inputs))
                          : rows;
    RAVENCAL_ASSIGN_OR_RETURN(packing.inputs,
                              model::measure_layer_inputs(outcome.compacted.model, kept));
  }
  RAVENCAL_RETURN_IF_ERROR(convert::bound_loop(arguments, outcome));
  RAVENCAL_ASSIGN_OR_RETURN(outcome.blob, model::encode_blob(outcome.compacted.model, packing));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> as_trained,
                            model::encode_blob(outcome.model));
  outcome.f32_bytes_per_step = convert::bytes_per_step(as_trained);
  return {};
}

core::Status check(const Arguments& arguments, Outcome& outcome) {
  const std::vector<std::string> files =
      arguments.check.empty() ? arguments.calibrate : std::vector{arguments.check};
  if (files.empty()) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            exchange::load_recording(files.front(), arguments.load));
  // The check reads the written bytes back.
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel weights,
                            model::decode_blob(outcome.blob, arguments.out));
  RAVENCAL_ASSIGN_OR_RETURN(outcome.check,
                            conversion::check_weights(outcome.model, weights, recording));
  for (const conversion::JointCheck& joint : outcome.check->joints) {
    const auto change = joint.rmse_change_percent();
    if (!change && !convert::is_exact(arguments)) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: no row has the truth and the estimate of joint {}, so "
                                     "that the change of RMSE cannot be measured",
                                     recording.source, joint.joint)};
    }
    const bool above = change && !(*change <= arguments.max_rmse_change_percent);
    outcome.accepted = outcome.accepted && !above;
  }
  return {};
}

/// Compares the weights with the file that another program wrote.
core::Status check_source(const Arguments& arguments, Outcome& outcome) {
  if (!outcome.foreign) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel weights,
                            model::decode_blob(outcome.blob, arguments.out));
  RAVENCAL_ASSIGN_OR_RETURN(
      outcome.source_check,
      conversion::check_source(outcome.foreign->model, outcome.foreign->scaling, outcome.model,
                               weights, outcome.compacted.kept_inputs));
  const auto& joints = outcome.source_check->joints;
  const bool is_same = std::all_of(joints.begin(), joints.end(),
                                   [](const auto& joint) { return joint.is_rounding(); });
  outcome.is_other = convert::is_exact(arguments) && !is_same;
  outcome.accepted = outcome.accepted && !outcome.is_other;
  return {};
}

core::Status run(const Arguments& arguments, int& exit_code) {
  Outcome outcome;
  RAVENCAL_ASSIGN_OR_RETURN(outcome.calibrate,
                            load_recordings(arguments.calibrate, arguments.load));
  RAVENCAL_RETURN_IF_ERROR(read_model(arguments, outcome));
  RAVENCAL_RETURN_IF_ERROR(check_loadable(arguments.model, outcome.model));
  RAVENCAL_RETURN_IF_ERROR(complete_origin(arguments, outcome));
  RAVENCAL_RETURN_IF_ERROR(make_blob(arguments, outcome));
  RAVENCAL_RETURN_IF_ERROR(check_source(arguments, outcome));
  RAVENCAL_RETURN_IF_ERROR(check(arguments, outcome));
  if (outcome.accepted) {
    RAVENCAL_ASSIGN_OR_RETURN(outcome.kernels,
                              conversion::check_kernels(outcome.blob, arguments.out));
    RAVENCAL_RETURN_IF_ERROR(model::write_blob(outcome.blob, arguments.out));
  } else {
    exit_code = cli::kFinding;
  }
  arguments.json ? convert::print_json(arguments, outcome) : convert::print(arguments, outcome);
  return {};
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
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
  command->add_option("--check", arguments->check,
                      "Recording on which to compare the weights with the model");
  command
      ->add_option("--max-rmse-change", arguments->max_rmse_change_percent,
                   "Refuse (exit 1) weights that raise a joint's RMSE by more than this, percent")
      ->check(cli::not_negative())
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print JSON");
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
          [arguments, command, origin, compact, &exit_code] {
            arguments->origin = given_origin(*command, *origin);
            arguments->compact = compact->count() > 0;
            return run(*arguments, exit_code);
          });
}

}  // namespace ravencal::commands
