// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

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
  std::string check;
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

core::Result<Comparison> compare(const model::CalibrationModel& model,
                                 const model::CalibrationModel& weights,
                                 const record::Recording& recording) {
  RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix features,
                            model::feature_matrix(model.features, recording, model.row_period_s));
  const Eigen::MatrixXd wanted = model.predict(features.cast<double>());
  const Eigen::MatrixXf got = model::predict_single(weights, features.transpose());
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

core::Status run(const Arguments& arguments) {
  if (arguments.precision != "f32") {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format("--precision {}: this build writes f32 only", arguments.precision)};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel model, read_model(arguments.model));
  RAVENCAL_RETURN_IF_ERROR(model::write_blob(model, arguments.out));
  // What was written is read back: the check below compares the file, not the intention.
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel weights, model::read_blob(arguments.out));
  fmt::print("{}: {} bytes, f32, {} inputs, {} outputs\n", arguments.out,
             std::filesystem::file_size(arguments.out), weights.features.size(),
             weights.outputs.size());
  if (arguments.check.empty()) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            record::load_recording(arguments.check, arguments.load));
  RAVENCAL_ASSIGN_OR_RETURN(const Comparison comparison, compare(model, weights, recording));
  print(comparison, model);
  return {};
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("convert", "Turn a model into weights for the plugin");
  command->add_option("model", arguments->model, "Model of `ravencal train` (.onnx)")->required();
  command->add_option("--out", arguments->out, "Weights to write (.blob)")->required();
  command->add_option("--precision", arguments->precision, "Precision of the weights: f32")
      ->check(CLI::IsMember({"f32", "bf16", "int8"}))
      ->capture_default_str();
  command->add_option("--check", arguments->check,
                      "Recording on which to compare the weights with the model");
  add_load_options(*command, arguments->load);
  command->footer("Example: ravencal convert model.onnx --out weights.blob --check test.db");
  on_call(*command, exit_code, [arguments] { return run(*arguments); });
}

}  // namespace ravencal::commands
