// SPDX-License-Identifier: Apache-2.0
#include "conversion/convert.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <span>

#include "conversion/assemble.hpp"
#include "conversion/bound_loop.hpp"
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
#include "model/feature_matrix.hpp"

namespace ravencal::conversion {

namespace {

std::size_t bytes_per_step(const std::vector<std::byte>& blob) {
  model::BlobView view;
  return model::BlobView::open(blob, view).ok() ? view.bytes_per_step() : 0;
}

/// Rows of these recordings without a lost value; `model` needs its features and row period only.
core::Result<model::FeatureMatrix> rows_of(const std::vector<record::Recording>& recordings,
                                           const model::CalibrationModel& model) {
  model::FeatureMatrix rows(0, static_cast<Eigen::Index>(model.features.size()));
  for (const record::Recording& recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix features,
                              model::feature_matrix(model.features, recording, model.row_period_s));
    append_whole_rows(features, rows);
  }
  return rows;
}

/// Fills in the model, whoever trained it.
core::Status read_model(const Request& request, Outcome& outcome) {
  const std::string extension = std::filesystem::path(request.model).extension().string();
  const bool is_onnx = extension == ".onnx";
  if (!is_onnx && extension != ".h5" && extension != ".hdf5") {
    return core::usage_error(fmt::format(
        "{}: unknown kind of model; .onnx and .h5 are read{}", request.model,
        extension == ".keras" ? " (Keras writes one by model.save(\"model.h5\"))" : ""));
  }
  if (is_onnx) {
    RAVENCAL_ASSIGN_OR_RETURN(const bool is_own, learn::is_ravencal_onnx(request.model));
    if (is_own && !request.scaling.empty()) {
      return core::usage_error(
          fmt::format("{}: contains its scaling; leave out --scaling", request.model));
    }
    if (is_own) {
      RAVENCAL_ASSIGN_OR_RETURN(outcome.model, learn::read_onnx(request.model));
      return {};
    }
  }
  if (request.scaling.empty()) {
    return core::usage_error(
        fmt::format("{}: was not trained by ravencal: --scaling FILE must say what its "
                    "inputs and outputs are (JSON or .npz)",
                    request.model));
  }
  Foreign foreign;
  RAVENCAL_ASSIGN_OR_RETURN(foreign.scaling, read_scaling_file(request.scaling));
  RAVENCAL_ASSIGN_OR_RETURN(foreign.model,
                            is_onnx ? read_foreign_onnx(request.model) : read_keras(request.model));
  model::CalibrationModel described;
  described.features = foreign.scaling.features;
  described.row_period_s = foreign.scaling.row_period_s;
  model::FeatureMatrix rows;
  if (!request.calibrate.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(rows, rows_of(outcome.calibrate, described));
  }
  auto model = assemble(foreign.model, foreign.scaling, rows);
  if (!model.ok()) {
    return core::Error{model.error().code,
                       fmt::format("{}: {}", request.model, model.error().message)};
  }
  outcome.model = std::move(*model);
  RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, learn::sha256_of_file(request.model));
  outcome.model.provenance["source"] =
      fmt::format("{} sha256:{}", std::filesystem::path(request.model).filename().string(), hash);
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
core::Status complete_origin(const Request& request, Outcome& outcome) {
  model::Origin& origin = outcome.model.origin;
  RAVENCAL_ASSIGN_OR_RETURN(
      origin, model::joined(origin, request.origin,
                            "--arm, --robot, --controller, --coordinates against the model"));
  RAVENCAL_ASSIGN_OR_RETURN(origin, learn::common_origin(origin, pointers_to(outcome.calibrate)));
  return {};
}

core::Status make_blob(const Request& request, Outcome& outcome) {
  model::Packing packing;
  RAVENCAL_ASSIGN_OR_RETURN(packing.precision, model::precision_of(request.precision));
  const bool is_int8 = packing.precision == model::packed::Precision::kInt8;
  const bool needs_rows = is_int8 || (request.compact && request.budget > 0.0);
  if (needs_rows && request.calibration_files().empty()) {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format(
            "{} needs recordings of the training: give them with --calibrate (or one with --check)",
            is_int8 ? "--precision int8" : "--compact with a budget")};
  }
  model::FeatureMatrix rows;
  if (is_int8 || request.compact) {
    std::vector<record::Recording> checked;
    if (outcome.calibrate.empty()) {
      RAVENCAL_ASSIGN_OR_RETURN(
          checked, exchange::load_recordings(request.calibration_files(), request.load));
    }
    RAVENCAL_ASSIGN_OR_RETURN(
        rows, rows_of(outcome.calibrate.empty() ? checked : outcome.calibrate, outcome.model));
    outcome.calibration_rows = rows.rows();
  }
  if (request.compact) {
    if (window_of(outcome.model) > 1) {
      return core::usage_error(
          fmt::format("{}: --compact cannot make a network with a GRU smaller; leave it out, "
                      "or train one with fewer units",
                      request.model));
    }
    RAVENCAL_ASSIGN_OR_RETURN(outcome.compacted,
                              model::compact(outcome.model, rows, {request.budget}));
    outcome.compacted.model.provenance["compacted"] =
        fmt::format("{} of {} weights, budget {}, outputs change by {:.4g} of their spread",
                    outcome.compacted.weights_after, outcome.compacted.weights_before,
                    request.budget, outcome.compacted.output_change);
  } else {
    outcome.compacted.model = outcome.model;
    outcome.compacted.kept_inputs.resize(outcome.model.features.size());
    std::iota(outcome.compacted.kept_inputs.begin(), outcome.compacted.kept_inputs.end(),
              std::size_t{0});
  }
  if (is_int8) {
    const model::FeatureMatrix kept =
        request.compact ? model::FeatureMatrix(rows(Eigen::all, outcome.compacted.kept_inputs))
                        : rows;
    RAVENCAL_ASSIGN_OR_RETURN(packing.inputs,
                              model::measure_layer_inputs(outcome.compacted.model, kept));
  }
  RAVENCAL_RETURN_IF_ERROR(bound_loop(request, outcome));
  RAVENCAL_ASSIGN_OR_RETURN(outcome.blob, model::encode_blob(outcome.compacted.model, packing));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> as_trained,
                            model::encode_blob(outcome.model));
  outcome.bytes_per_step = bytes_per_step(outcome.blob);
  outcome.f32_bytes_per_step = bytes_per_step(as_trained);
  return {};
}

core::Status check(const Request& request, Outcome& outcome) {
  const std::vector<std::string> files =
      request.check.empty() ? request.calibrate : std::vector{request.check};
  if (files.empty()) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                            exchange::load_recording(files.front(), request.load));
  // The check reads the written bytes back.
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel weights,
                            model::decode_blob(outcome.blob, request.out));
  RAVENCAL_ASSIGN_OR_RETURN(outcome.check, check_weights(outcome.model, weights, recording));
  for (const JointCheck& joint : outcome.check->joints) {
    const auto change = joint.rmse_change_percent();
    if (!change && !request.is_exact()) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: no row has the truth and the estimate of joint {}, so "
                                     "that the change of RMSE cannot be measured",
                                     recording.source, joint.joint)};
    }
    const bool above = change && !(*change <= request.max_rmse_change_percent);
    // On the training's own rows, which are read where no other are named, it is only said.
    outcome.is_worse = outcome.is_worse || (!request.check.empty() && joint.is_worse_than_raw());
    outcome.accepted = outcome.accepted && !above;
  }
  outcome.accepted = outcome.accepted && !outcome.is_worse;
  return {};
}

/// Compares the weights with the file that another program wrote.
core::Status check_source(const Request& request, Outcome& outcome) {
  if (!outcome.foreign) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const model::CalibrationModel weights,
                            model::decode_blob(outcome.blob, request.out));
  RAVENCAL_ASSIGN_OR_RETURN(outcome.source_check,
                            check_source(outcome.foreign->model, outcome.foreign->scaling,
                                         outcome.model, weights, outcome.compacted.kept_inputs));
  const auto& joints = outcome.source_check->joints;
  const bool is_same = std::all_of(joints.begin(), joints.end(),
                                   [](const auto& joint) { return joint.is_rounding(); });
  outcome.is_other = request.is_exact() && !is_same;
  outcome.accepted = outcome.accepted && !outcome.is_other;
  return {};
}

}  // namespace

std::vector<std::string> Request::calibration_files() const {
  if (!calibrate.empty() || check.empty()) return calibrate;
  return {check};
}

bool Request::is_exact() const { return precision == "f32" && budget == 0.0; }

core::Result<Outcome> convert(const Request& request) {
  Outcome outcome;
  RAVENCAL_ASSIGN_OR_RETURN(outcome.calibrate,
                            exchange::load_recordings(request.calibrate, request.load));
  RAVENCAL_RETURN_IF_ERROR(read_model(request, outcome));
  RAVENCAL_RETURN_IF_ERROR(check_loadable(request.model, outcome.model));
  RAVENCAL_RETURN_IF_ERROR(complete_origin(request, outcome));
  RAVENCAL_RETURN_IF_ERROR(make_blob(request, outcome));
  RAVENCAL_RETURN_IF_ERROR(check_source(request, outcome));
  RAVENCAL_RETURN_IF_ERROR(check(request, outcome));
  if (!outcome.accepted) return outcome;
  RAVENCAL_ASSIGN_OR_RETURN(outcome.kernels, check_kernels(outcome.blob, request.out));
  RAVENCAL_RETURN_IF_ERROR(model::write_blob(outcome.blob, request.out));
  return outcome;
}

}  // namespace ravencal::conversion
