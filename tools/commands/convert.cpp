// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cli/exit_code.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "learn/evaluate.hpp"
#include "learn/onnx_file.hpp"
#include "model/blob_writer.hpp"
#include "model/feature_matrix.hpp"
#include "model/input_limits.hpp"
#include "model/single_precision.hpp"
#include "record/load.hpp"

namespace ravencal::commands {
namespace {

struct Arguments {
  std::string model;
  std::string out;
  std::string precision = "f32";
  std::string calibrate;
  std::string check;
  double max_rmse_change_percent = 2.0;
  record::LoadOptions load;
};

core::Result<model::CalibrationModel> read_model(const std::filesystem::path& path) {
  if (path.extension() == ".onnx") return learn::read_onnx(path);
  return core::Error{
      core::ErrorCode::kUsage,
      fmt::format("{}: unknown kind of model; this build converts .onnx", path.string())};
}

/// Differences between the model in double precision and the weights as the plugin runs them.
struct Comparison {
  Eigen::VectorXd
      inside;  ///< largest per output, rows whose inputs are taken as they are; SI units
  Eigen::VectorXd clamped;  ///< the same, rows with an input that the plugin clamps
  Eigen::Index rows_inside = 0;
  Eigen::Index rows_clamped = 0;
  Eigen::Index rows_lost = 0;  ///< left out: an input is not a number
};

bool is_clamped(const model::CalibrationModel& weights,
                const Eigen::Ref<const Eigen::RowVectorXf>& features) {
  for (Eigen::Index i = 0; i < features.size(); ++i) {
    const auto limits = model::input_limits(weights.input_min[i], weights.input_max[i]);
    if (features[i] < limits.low || features[i] > limits.high) return true;
  }
  return false;
}

/// Joint errors as the plugin computes them, [outputs x rows].
Eigen::MatrixXf run_single(const model::CalibrationModel& weights,
                           const model::FeatureMatrix& features) {
  Eigen::MatrixXf result(static_cast<Eigen::Index>(weights.outputs.size()), features.rows());
  constexpr Eigen::Index kRows = 4096;  // bounds the memory of the hidden layers
  for (Eigen::Index row = 0; row < features.rows(); row += kRows) {
    const Eigen::Index count = std::min(kRows, features.rows() - row);
    result.middleCols(row, count) =
        model::predict_single(weights, features.middleRows(row, count).transpose());
  }
  return result;
}

Comparison compare(const model::CalibrationModel& model, const model::CalibrationModel& weights,
                   const model::FeatureMatrix& features) {
  const Eigen::MatrixXd wanted = model.predict(features.cast<double>());
  const Eigen::MatrixXf got = run_single(weights, features);
  Comparison result;
  result.inside = Eigen::VectorXd::Zero(wanted.cols());
  result.clamped = result.inside;
  for (Eigen::Index row = 0; row < features.rows(); ++row) {
    if (!features.row(row).allFinite()) {
      ++result.rows_lost;
      continue;
    }
    const bool inside = !is_clamped(weights, features.row(row));
    const Eigen::VectorXd difference =
        (wanted.row(row).transpose() - got.col(row).cast<double>()).cwiseAbs();
    Eigen::VectorXd& largest = inside ? result.inside : result.clamped;
    largest = largest.cwiseMax(difference);
    ++(inside ? result.rows_inside : result.rows_clamped);
  }
  return result;
}

/// Remaining errors of one joint on a recording, SI units: with the model in f32, and as packed.
struct RmseChange {
  double before = 0.0;
  double after = 0.0;
  [[nodiscard]] double percent() const { return 100.0 * (after / before - 1.0); }
};

core::Result<std::vector<RmseChange>> rmse_changes(const model::CalibrationModel& model,
                                                   const model::CalibrationModel& weights,
                                                   const model::FeatureMatrix& features,
                                                   const record::Recording& recording) {
  const Eigen::MatrixXf in_f32 = run_single(model, features);
  const Eigen::MatrixXf as_packed = run_single(weights, features);
  std::vector<RmseChange> changes;
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    const model::OutputSpec& output = model.outputs[k];
    const auto truth = recording.column(record::Role::kJointTruth, output.joint);
    const auto estimate = recording.column(output.estimate_channel);
    std::vector<double> true_values;
    std::vector<double> before;
    std::vector<double> after;
    for (Eigen::Index row = 0; truth && estimate && row < features.rows(); ++row) {
      const double true_value = recording.samples(row, *truth);
      const double raw = recording.samples(row, *estimate);
      if (!std::isfinite(true_value) || !std::isfinite(raw)) continue;
      if (!features.row(row).allFinite()) continue;
      const auto j = static_cast<Eigen::Index>(k);
      true_values.push_back(true_value);
      before.push_back(raw + static_cast<double>(in_f32(j, row)));
      after.push_back(raw + static_cast<double>(as_packed(j, row)));
    }
    if (true_values.empty()) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: no row has the truth and the estimate of joint {}, so "
                                     "that the change of RMSE cannot be measured",
                                     recording.source, output.joint)};
    }
    changes.push_back({learn::error_statistics(before, true_values, 0.0).rmse,
                       learn::error_statistics(after, true_values, 0.0).rmse});
  }
  return changes;
}

/// Prints the changes; false if one is above the limit.
bool accept(const std::vector<RmseChange>& changes, const model::CalibrationModel& model,
            double limit_percent) {
  bool accepted = true;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    const learn::DisplayUnit unit = learn::display_unit(model.outputs[k].unit);
    const RmseChange& change = changes[k];
    const bool above = !(change.percent() <= limit_percent);
    fmt::print("  {:<12} RMSE {:.4g} {} in f32, {:.4g} {} as packed: {:+.3f} %{}\n",
               model.outputs[k].joint, change.before * unit.per_si, unit.name,
               change.after * unit.per_si, unit.name, change.percent(),
               above ? fmt::format(", above {:g} %", limit_percent) : "");
    accepted = accepted && !above;
  }
  return accepted;
}

void print(const Comparison& comparison, const model::CalibrationModel& model) {
  fmt::print("check: {} rows as they are, {} with inputs that the plugin clamps",
             comparison.rows_inside, comparison.rows_clamped);
  if (comparison.rows_lost > 0) fmt::print(", {} left out (lost values)", comparison.rows_lost);
  fmt::print("\n");
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const learn::DisplayUnit unit = learn::display_unit(model.outputs[k].unit);
    fmt::print("  {:<12} largest difference {:.3g} {} by rounding, {:.3g} {} by clamping\n",
               model.outputs[k].joint, comparison.inside[j] * unit.per_si, unit.name,
               comparison.clamped[j] * unit.per_si, unit.name);
  }
}

struct Rows {
  record::Recording recording;
  model::FeatureMatrix features;
};

core::Result<Rows> load_rows(const std::string& path, const Arguments& arguments,
                             const model::CalibrationModel& model) {
  Rows rows;
  RAVENCAL_ASSIGN_OR_RETURN(rows.recording, record::load_recording(path, arguments.load));
  RAVENCAL_ASSIGN_OR_RETURN(
      rows.features, model::feature_matrix(model.features, rows.recording, model.row_period_s));
  return rows;
}

core::Result<model::Packing> make_packing(const Arguments& arguments,
                                          const model::CalibrationModel& model) {
  model::Packing packing;
  RAVENCAL_ASSIGN_OR_RETURN(packing.precision, model::precision_of(arguments.precision));
  if (packing.precision != model::packed::Precision::kInt8) return packing;
  const std::string& path = arguments.calibrate.empty() ? arguments.check : arguments.calibrate;
  if (path.empty()) {
    return core::Error{core::ErrorCode::kUsage,
                       "--precision int8 is calibrated by what the layers see: give a recording of "
                       "the training with --calibrate (or one with --check)"};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const Rows rows, load_rows(path, arguments, model));
  RAVENCAL_ASSIGN_OR_RETURN(packing.inputs, model::measure_layer_inputs(model, rows.features));
  fmt::print("int8 calibrated on {}, {} rows\n", path, rows.features.rows());
  return packing;
}

/// Compares the weights with the model on the recording; false if they are too much worse.
core::Result<bool> check(const std::string& path, const Arguments& arguments,
                         const model::CalibrationModel& model,
                         const model::CalibrationModel& weights) {
  RAVENCAL_ASSIGN_OR_RETURN(const Rows rows, load_rows(path, arguments, model));
  print(compare(model, weights, rows.features), model);
  const auto changes = rmse_changes(model, weights, rows.features, rows.recording);
  if (!changes.ok()) {
    if (arguments.precision != "f32") return changes.error();
    fmt::print("{}\n", changes.error().message);  // f32 changes nothing that a truth would show
    return true;
  }
  return accept(*changes, model, arguments.max_rmse_change_percent);
}

core::Status run(const Arguments& arguments, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model, read_model(arguments.model));
  RAVENCAL_ASSIGN_OR_RETURN(const model::Packing packing, make_packing(arguments, model));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, model::encode_blob(model, packing));
  // The bytes are read back: the check compares what is written, not the intention.
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel weights,
                            model::decode_blob(bytes, arguments.out));
  const std::string& path = arguments.check.empty() ? arguments.calibrate : arguments.check;
  if (!path.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(const bool accepted, check(path, arguments, model, weights));
    if (!accepted) {
      fmt::print("{} is not written: {} costs too much accuracy (--max-rmse-change)\n",
                 arguments.out, arguments.precision);
      exit_code = cli::kFinding;
      return {};
    }
  } else if (packing.precision != model::packed::Precision::kFloat32) {
    fmt::print("not checked: --check RECORDING shows what {} costs\n", arguments.precision);
  }
  RAVENCAL_RETURN_IF_ERROR(model::write_blob(bytes, arguments.out));
  fmt::print("{}: {} bytes, {}, {} inputs, {} outputs\n", arguments.out, bytes.size(),
             arguments.precision, weights.features.size(), weights.outputs.size());
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
  command->add_option("--calibrate", arguments->calibrate,
                      "int8: recording of the training; default: that of --check");
  command->add_option("--check", arguments->check,
                      "Recording on which to compare the weights with the model");
  command
      ->add_option("--max-rmse-change", arguments->max_rmse_change_percent,
                   "Refuse (exit 1) weights that raise a joint's RMSE by more than this, percent")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_load_options(*command, arguments->load);
  command->footer(
      "Examples:\n"
      "  ravencal convert model.onnx --out weights.blob --check test.db\n"
      "  ravencal convert model.onnx --out weights.blob --precision int8 --calibrate train.db "
      "--check test.db");
  on_call(*command, exit_code, [arguments, &exit_code] { return run(*arguments, exit_code); });
}

}  // namespace ravencal::commands
