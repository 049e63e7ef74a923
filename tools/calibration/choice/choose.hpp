// SPDX-License-Identifier: Apache-2.0
//
// `train` without a method: per joint, candidates are compared on parts of the training that they
// were not fitted to, and the best one, or a mean of some, becomes the joint's model. All joints
// together are one network. Only training recordings are read.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "choice/combination.hpp"
#include "choice/sessions.hpp"
#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "model/origin.hpp"
#include "record/recording.hpp"

namespace ravencal::choice {

/// Which candidates are tried.
enum class Kinds {
  kAll,
  kLinear,  ///< linear in the inputs and their memory
  kUnits,   ///< with random units
};

struct ChoiceOptions {
  Kinds kinds = Kinds::kAll;
  std::string features;             ///< grammar: model::select_features; empty: offered_inputs
  std::vector<std::string> joints;  ///< outputs; empty: every joint that has a truth
  model::Origin origin;             ///< given by the user; the recordings add the rest
  bool at_hook = false;  ///< inputs as the plugin sees them at its hook (model/hook_view.hpp)
  SessionRule sessions = SessionRule::kAuto;
  std::uint64_t seed = 3;
};

/// A row of the table: one candidate of one joint.
struct TriedModel {
  std::string name;
  double ridge = 0.0;         ///< 0: none
  double inside_rmse = 0.0;   ///< on parts that the fit did not see, SI
  double inside_error = 0.0;  ///< its standard error, SI
  double outside_rmse = 0.0;  ///< on farther, faster, more loaded halves, SI; NaN: none
  double weight = 0.0;        ///< in the joint's model; 0: not chosen
};

struct JointChoice {
  std::string joint;
  std::string unit;  ///< SI
  std::vector<TriedModel> tried;
  std::size_t parts = 0;  ///< held out in turn
  bool parts_are_recordings = false;
  std::vector<double> session_constants;  ///< of the chosen model, SI
  std::vector<double> homing_constants;   ///< of the homings that these show, SI
};

struct Choice {
  model::CalibrationModel model;
  std::vector<JointChoice> joints;
  model::FeatureMatrix rows;          ///< inputs of the training, at most kMostRows
  bool interrupted = false;           ///< the best of those that were tried
  std::vector<std::string> warnings;  ///< sentences
};

/// `keep_going` is called with the share done and the candidate in work; false ends the search, and
/// what was tried until then is chosen from. The same seed and recordings give the same model.
/// Errors: kUsage for features that do not exist, kData for recordings that do not fit, or that are
/// not of one arm, robot, controller and kind of coordinates.
core::Result<Choice> choose_model(
    std::span<const record::Recording* const> training, const ChoiceOptions& options,
    const std::function<bool(double, const std::string&)>& keep_going);

}  // namespace ravencal::choice
