// SPDX-License-Identifier: Apache-2.0
//
// From a model to weights of the plugin: reads the model, whoever trained it, joins its origin,
// removes and rounds what was asked, bounds the loop that it closes, checks and writes.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "conversion/foreign_model.hpp"
#include "conversion/scaling_file.hpp"
#include "conversion/source_check.hpp"
#include "conversion/weights_check.hpp"
#include "core/result.hpp"
#include "loop/margins.hpp"
#include "model/compact.hpp"
#include "record/load.hpp"

namespace ravencal::conversion {

struct Request {
  std::string model;    ///< .onnx, .h5
  std::string scaling;  ///< of a model of another program
  std::string out;      ///< weights to write
  std::string precision = "f32";
  std::vector<std::string> calibrate;  ///< recordings of the training
  std::string check;                   ///< recording on which weights and model are compared
  bool compact = false;
  double budget = 0.0;  ///< share of the outputs' spread that `compact` may change
  double max_rmse_change_percent = 2.0;
  std::string plant;            ///< with whose servo the loop's margins are computed
  bool unbounded_loop = false;  ///< write weights whose loop is not known or has too small margins
  model::Origin origin;         ///< what the user says of it
  record::LoadOptions load;

  /// Recordings by which layers are calibrated: those of the training, or the one to check with.
  [[nodiscard]] std::vector<std::string> calibration_files() const;
  /// Whether nothing but the order of sums can differ from the model.
  [[nodiscard]] bool is_exact() const;
};

/// A model that another program trained.
struct Foreign {
  ForeignModel model;
  ScalingFile scaling;
};

/// All that a conversion made and measured.
struct Outcome {
  std::optional<Foreign> foreign;
  std::vector<record::Recording> calibrate;  ///< those of Request::calibrate
  model::CalibrationModel model;             ///< as trained
  model::Compacted compacted;
  Eigen::Index calibration_rows = 0;
  std::vector<std::byte> blob;
  std::size_t bytes_per_step = 0;      ///< of the blob
  std::size_t f32_bytes_per_step = 0;  ///< of the model as trained
  std::optional<WeightsCheck> check;
  std::vector<std::string> kernels;  ///< instruction sets whose code passed the self-test
  std::optional<SourceCheck> source_check;
  std::optional<loop::Margins> margins;
  bool is_unstable = false;  ///< margins below the least
  bool is_worse = false;     ///< than no correction, on the recording of Request::check
  bool is_other = false;     ///< f32 weights that compute something else than their source
  bool accepted = true;      ///< and written
};

/// Errors: a file cannot be read or written; the model is not for the plugin, or needs a scaling
/// file, recordings or a bound of its loop that are not given (kUsage); the self-test failed.
core::Result<Outcome> convert(const Request& request);

/// For people, and for programs (FORMATS.md).
std::string describe(const Request& request, const Outcome& outcome);
std::string to_json(const Request& request, const Outcome& outcome);

}  // namespace ravencal::conversion
