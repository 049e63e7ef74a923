// SPDX-License-Identifier: Apache-2.0
//
// `ravencal convert` in two steps: convert.cpp makes and checks the weights, convert_print.cpp
// says what came of it. This is what the two share.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "commands/loop_margins.hpp"
#include "conversion/foreign_model.hpp"
#include "conversion/scaling_file.hpp"
#include "conversion/source_check.hpp"
#include "conversion/weights_check.hpp"
#include "loop/margins.hpp"
#include "model/compact.hpp"
#include "record/load.hpp"

namespace ravencal::commands::convert {

struct Arguments {
  std::string model;
  std::string scaling;
  std::string out;
  std::string precision = "f32";
  std::vector<std::string> calibrate;
  std::string check;
  bool compact = false;
  double budget = 0.0;
  double max_rmse_change_percent = 2.0;
  bool json = false;
  std::string plant;            ///< with whose servo the loop's margins are computed
  bool unbounded_loop = false;  ///< write weights whose loop is not known or has too small margins
  model::Origin origin;         ///< what the user says of it
  record::LoadOptions load;
};

/// A model that another program trained.
struct Foreign {
  conversion::ForeignModel model;
  conversion::ScalingFile scaling;
};

/// All that a conversion made and measured.
struct Outcome {
  std::optional<Foreign> foreign;
  std::vector<record::Recording> calibrate;  ///< those of --calibrate
  model::CalibrationModel model;             ///< as trained
  model::Compacted compacted;
  Eigen::Index calibration_rows = 0;
  std::vector<std::byte> blob;
  std::size_t f32_bytes_per_step = 0;  ///< of the model as trained
  std::optional<conversion::WeightsCheck> check;
  std::vector<std::string> kernels;  ///< instruction sets whose code passed the self-test
  std::optional<conversion::SourceCheck> source_check;
  std::optional<loop::Margins> margins;
  bool is_unstable = false;  ///< margins below the least
  bool is_other = false;     ///< f32 weights that compute something else than their source
  bool accepted = true;
};

/// Recordings by which layers are calibrated: those of the training, or the one to check with.
std::vector<std::string> calibration_files(const Arguments& arguments);
/// Whether nothing but the order of sums can differ from the model.
bool is_exact(const Arguments& arguments);
std::size_t bytes_per_step(const std::vector<std::byte>& blob);

/// Computes gains and, with a plant, margins of the loop that the model closes, into the model that
/// becomes the weights. Errors (kUsage): it closes one, and neither training nor recordings tell
/// its gains, unless --unbounded-loop.
core::Status bound_loop(const Arguments& arguments, Outcome& outcome);
/// Appends the rows without a lost value.
void append_whole_rows(const model::FeatureMatrix& more, model::FeatureMatrix& rows);

void print(const Arguments& arguments, const Outcome& outcome);
void print_json(const Arguments& arguments, const Outcome& outcome);

}  // namespace ravencal::commands::convert
