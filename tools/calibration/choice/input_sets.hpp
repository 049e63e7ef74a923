// SPDX-License-Identifier: Apache-2.0
//
// The inputs that `train` offers to its candidates when the user names none: what a robot has at
// its motors, and what its cables remember.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::choice {

struct InputSet {
  std::string name;                   ///< e.g. "positions and their memory"
  std::vector<Eigen::Index> columns;  ///< of InputSets::features
};

/// What one output may be predicted from.
struct OutputInputs {
  std::vector<InputSet> own;     ///< of the output's joint, from few to many inputs
  std::vector<InputSet> others;  ///< of other joints: inputs, memory, and both, each a block
};

struct InputSets {
  std::vector<model::FeatureSpec> features;
  std::vector<Eigen::Index> positions;  ///< columns of positions as they are
  std::vector<OutputInputs> of_output;  ///< [outputs]
  std::vector<std::string> held;        ///< joints that were held still: they get no input
};

/// Positions: every joint estimate and motor position, and on a robot without RAVEN-II's channels
/// every temperature and other feature. Their memory: play operators of a ladder of half-widths, in
/// shares of the range of motion, because friction, slack and stretch make the error depend on
/// where a joint came from. Efforts: drive torques and inputs, smoothed, and their means over the
/// joint's travel, which tell load and friction at every speed alike. Recent motion, where rows are
/// dense: means of positions over a second, and earlier positions, by which a drive lags in fast
/// motion. On a RAVEN-II the measured joints are the only positions and there are no efforts: the
/// rest answers to the motor command, and the plugin would close a loop through it; nor earlier
/// positions, whose small differences int8 rounds away.
/// What a joint that was held still shows is noise, and is not offered. Truths, loads (sensors
/// behind the cables), desired values and velocities are never offered. Errors (kData): nothing to
/// offer.
core::Result<InputSets> offered_inputs(std::span<const record::Recording* const> recordings,
                                       std::span<const model::OutputSpec> outputs);

/// The sets of inputs that the user named: all, and those of them that are no memory.
InputSets given_inputs(std::vector<model::FeatureSpec> features, const record::Recording& recording,
                       std::size_t outputs);

}  // namespace ravencal::choice
