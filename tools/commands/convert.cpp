// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/exit_code.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "conversion/weights_check.hpp"
#include "learn/evaluate.hpp"
#include "learn/onnx_file.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "model/compact.hpp"
#include "model/feature_matrix.hpp"
#include "record/load.hpp"

namespace ravencal::commands {
namespace {

using conversion::WeightsCheck;

struct Arguments {
  std::string model;
  std::string out;
  std::string precision = "f32";
  std::vector<std::string> calibrate;
  std::string check;
  bool compact = false;
  double budget = 0.0;
  double max_rmse_change_percent = 2.0;
  bool json = false;
  record::LoadOptions load;
};

/// All that a conversion made and measured.
struct Outcome {
  model::CalibrationModel model;  ///< as trained
  model::Compacted compacted;
  Eigen::Index calibration_rows = 0;
  std::vector<std::byte> blob;
  std::size_t f32_bytes_per_step = 0;  ///< of the model as trained
  std::optional<WeightsCheck> check;
  bool accepted = true;
};

core::Result<model::CalibrationModel> read_model(const std::filesystem::path& path) {
  if (path.extension() == ".onnx") return learn::read_onnx(path);
  return core::Error{
      core::ErrorCode::kUsage,
      fmt::format("{}: unknown kind of model; this build converts .onnx", path.string())};
}

/// The recordings of the training, or the one to check with.
std::vector<std::string> calibration_files(const Arguments& arguments) {
  if (!arguments.calibrate.empty() || arguments.check.empty()) return arguments.calibrate;
  return {arguments.check};
}

/// Their rows without a lost value.
core::Result<model::FeatureMatrix> calibration_rows(const Arguments& arguments,
                                                    const model::CalibrationModel& model) {
  const std::vector<std::string> files = calibration_files(arguments);
  RAVENCAL_ASSIGN_OR_RETURN(const auto recordings, load_recordings(files, arguments.load));
  model::FeatureMatrix rows(0, static_cast<Eigen::Index>(model.features.size()));
  for (const record::Recording& recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix features,
                              model::feature_matrix(model.features, recording, model.row_period_s));
    Eigen::Index kept = rows.rows();
    rows.conservativeResize(kept + features.rows(), Eigen::NoChange);
    for (Eigen::Index row = 0; row < features.rows(); ++row) {
      if (features.row(row).allFinite()) rows.row(kept++) = features.row(row);
    }
    rows.conservativeResize(kept, Eigen::NoChange);
  }
  return rows;
}

std::size_t bytes_per_step(std::span<const std::byte> blob) {
  model::BlobView view;
  return model::BlobView::open(blob, view).ok() ? view.bytes_per_step() : 0;
}

core::Status make_blob(const Arguments& arguments, Outcome& outcome) {
  model::Packing packing;
  RAVENCAL_ASSIGN_OR_RETURN(packing.precision, model::precision_of(arguments.precision));
  const bool is_int8 = packing.precision == model::packed::Precision::kInt8;
  const bool needs_rows = is_int8 || (arguments.compact && arguments.budget > 0.0);
  if (needs_rows && calibration_files(arguments).empty()) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{} is calibrated by what the layers see: give recordings of "
                                   "the training with --calibrate (or one with --check)",
                                   is_int8 ? "--precision int8" : "--compact with a budget")};
  }
  model::FeatureMatrix rows;
  if (is_int8 || arguments.compact) {
    RAVENCAL_ASSIGN_OR_RETURN(rows, calibration_rows(arguments, outcome.model));
    outcome.calibration_rows = rows.rows();
  }
  if (arguments.compact) {
    RAVENCAL_ASSIGN_OR_RETURN(outcome.compacted,
                              model::compact(outcome.model, rows, {arguments.budget}));
    outcome.compacted.model.provenance["compacted"] =
        fmt::format("{} of {} weights, budget {}, outputs change by {:.4g} of their spread",
                    outcome.compacted.weights_after, outcome.compacted.weights_before,
                    arguments.budget, outcome.compacted.output_change);
  } else {
    outcome.compacted.model = outcome.model;
  }
  if (is_int8) {
    const model::FeatureMatrix kept =
        arguments.compact ? model::FeatureMatrix(rows(Eigen::all, outcome.compacted.kept_inputs))
                          : rows;
    RAVENCAL_ASSIGN_OR_RETURN(packing.inputs,
                              model::measure_layer_inputs(outcome.compacted.model, kept));
  }
  RAVENCAL_ASSIGN_OR_RETURN(outcome.blob, model::encode_blob(outcome.compacted.model, packing));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> as_trained,
                            model::encode_blob(outcome.model));
  outcome.f32_bytes_per_step = bytes_per_step(as_trained);
  return {};
}

/// Whether nothing but the order of sums can differ from the model.
bool is_exact(const Arguments& arguments) {
  return arguments.precision == "f32" && arguments.budget == 0.0;
}

core::Status check(const Arguments& arguments, Outcome& outcome) {
  const std::vector<std::string> files =
      arguments.check.empty() ? arguments.calibrate : std::vector{arguments.check};
  if (files.empty()) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            record::load_recording(files.front(), arguments.load));
  // The bytes are read back: the check compares what is written, not the intention.
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel weights,
                            model::decode_blob(outcome.blob, arguments.out));
  RAVENCAL_ASSIGN_OR_RETURN(outcome.check,
                            conversion::check_weights(outcome.model, weights, recording));
  for (const conversion::JointCheck& joint : outcome.check->joints) {
    const auto change = joint.rmse_change_percent();
    if (!change && !is_exact(arguments)) {
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

void print(const WeightsCheck& check, double limit_percent) {
  fmt::print("check: {} rows, {} with inputs that the plugin clamps", check.rows,
             check.rows_clamped);
  if (check.rows_lost > 0) fmt::print(", {} left out (lost values)", check.rows_lost);
  fmt::print("; confidence 1 in {}, 0 in {}\n", check.rows_trusted, check.rows_doubted);
  for (const conversion::JointCheck& joint : check.joints) {
    const learn::DisplayUnit unit = learn::display_unit(joint.unit);
    fmt::print("  {:<12} largest difference {:.3g} {}, where inputs are clamped {:.3g} {}\n",
               joint.joint, joint.largest_difference * unit.per_si, unit.name,
               joint.largest_clamped_difference * unit.per_si, unit.name);
    const auto change = joint.rmse_change_percent();
    if (!change) continue;
    const bool above = !(*change <= limit_percent);
    fmt::print("  {:<12} RMSE {:.4g} {} in f32, {:.4g} {} as packed: {:+.3f} %{}\n", "",
               *joint.model_rmse * unit.per_si, unit.name, *joint.weights_rmse * unit.per_si,
               unit.name, *change, above ? fmt::format(", above {:g} %", limit_percent) : "");
  }
}

void print(const Arguments& arguments, const Outcome& outcome) {
  if (outcome.calibration_rows > 0) {
    fmt::print("calibrated on {}, {} rows\n", fmt::join(calibration_files(arguments), ", "),
               outcome.calibration_rows);
  }
  if (arguments.compact) {
    fmt::print(
        "compact: {} of {} inputs, {} of {} weights; outputs change by {:.3g} % of their "
        "spread\n",
        outcome.compacted.kept_inputs.size(), outcome.model.features.size(),
        outcome.compacted.weights_after, outcome.compacted.weights_before,
        100.0 * outcome.compacted.output_change);
  }
  if (outcome.check) {
    print(*outcome.check, arguments.max_rmse_change_percent);
  } else if (!is_exact(arguments)) {
    fmt::print("not checked: --check RECORDING shows what {} costs\n",
               arguments.precision == "f32" ? "--compact" : arguments.precision);
  }
  if (!outcome.accepted) {
    fmt::print("{} is not written: it costs too much accuracy (--max-rmse-change)\n",
               arguments.out);
    return;
  }
  const std::size_t bytes = bytes_per_step(outcome.blob);
  fmt::print("{}: {} bytes, {}, {} inputs, {} outputs; {} bytes per step, 1/{:.3g} of f32\n",
             arguments.out, outcome.blob.size(), arguments.precision,
             outcome.compacted.model.features.size(), outcome.model.outputs.size(), bytes,
             static_cast<double>(outcome.f32_bytes_per_step) / static_cast<double>(bytes));
}

void print_json(const Arguments& arguments, const Outcome& outcome) {
  nlohmann::ordered_json json;
  json["weights"] = arguments.out;
  json["written"] = outcome.accepted;
  json["precision"] = arguments.precision;
  json["calibration_rows"] = outcome.calibration_rows;
  json["inputs"] = outcome.compacted.model.features.size();
  json["bytes_per_step"] = bytes_per_step(outcome.blob);
  json["bytes_per_step_f32"] = outcome.f32_bytes_per_step;
  if (arguments.compact) {
    json["compact"] = {{"budget", arguments.budget},
                       {"weights_before", outcome.compacted.weights_before},
                       {"weights_after", outcome.compacted.weights_after},
                       {"output_change", outcome.compacted.output_change}};
  }
  if (outcome.check) {
    json["check"] = {{"rows", outcome.check->rows},
                     {"rows_clamped", outcome.check->rows_clamped},
                     {"rows_lost", outcome.check->rows_lost},
                     {"rows_trusted", outcome.check->rows_trusted},
                     {"rows_doubted", outcome.check->rows_doubted}};
    for (const conversion::JointCheck& joint : outcome.check->joints) {
      nlohmann::ordered_json item = {
          {"joint", joint.joint},
          {"unit", joint.unit},
          {"largest_difference", joint.largest_difference},
          {"largest_clamped_difference", joint.largest_clamped_difference}};
      if (const auto change = joint.rmse_change_percent()) {
        item["model_rmse"] = *joint.model_rmse;
        item["weights_rmse"] = *joint.weights_rmse;
        item["rmse_change_percent"] = *change;
      }
      json["check"]["joints"].push_back(std::move(item));
    }
  }
  fmt::print("{}\n", json.dump(2));
}

core::Status run(const Arguments& arguments, int& exit_code) {
  Outcome outcome;
  RAVENCAL_ASSIGN_OR_RETURN(outcome.model, read_model(arguments.model));
  RAVENCAL_RETURN_IF_ERROR(make_blob(arguments, outcome));
  RAVENCAL_RETURN_IF_ERROR(check(arguments, outcome));
  if (outcome.accepted) {
    RAVENCAL_RETURN_IF_ERROR(model::write_blob(outcome.blob, arguments.out));
  } else {
    exit_code = cli::kFinding;
  }
  arguments.json ? print_json(arguments, outcome) : print(arguments, outcome);
  return {};
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("convert", "Turn a model into weights for the plugin");
  command->add_option("model", arguments->model, "Model of `ravencal train` (.onnx)")->required();
  command->add_option("--out", arguments->out, "Weights to write (.blob)")->required();
  command->add_option("--precision", arguments->precision, "Precision of the weights")
      ->check(CLI::IsMember({"f32", "bf16", "int8"}))
      ->capture_default_str();
  CLI::Option* compact = command->add_option(
      "--compact", arguments->budget,
      "Leave out inputs and units that change nothing, or, with a budget such as 0.02, all without "
      "which the outputs change by less than that share of their spread");
  compact->expected(0, 1)->check(CLI::Range(0.0, 1.0))->type_name("BUDGET");
  command->add_option("--calibrate", arguments->calibrate,
                      "int8, --compact: recordings of the training; default: that of --check");
  command->add_option("--check", arguments->check,
                      "Recording on which to compare the weights with the model");
  command
      ->add_option("--max-rmse-change", arguments->max_rmse_change_percent,
                   "Refuse (exit 1) weights that raise a joint's RMSE by more than this, percent")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "For programs");
  add_load_options(*command, arguments->load);
  command->footer(
      "Examples:\n"
      "  ravencal convert model.onnx --out weights.blob --check test.db\n"
      "  ravencal convert model.onnx --out weights.blob --precision int8 --compact 0.02 "
      "--calibrate train*.db --check test.db");
  on_call(*command, exit_code, [arguments, compact, &exit_code] {
    arguments->compact = compact->count() > 0;
    return run(*arguments, exit_code);
  });
}

}  // namespace ravencal::commands
