// SPDX-License-Identifier: Apache-2.0
//
// What the given plant and the improved one leave of the recordings from which figures are taken.
// Everything that is said "before" or "after" comes from here, and so from plants that can be read.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "diagnose/model/likelihood.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Measured less predicted, filtered: [channel][recording][row]. Without the constants that a plant
/// draws at homing, which are no error of it.
struct Left {
  std::vector<ByRecording> residuals;
  /// RMS over recordings of the constant that was taken off; none where none is drawn.
  std::vector<std::optional<double>> drawn_constant;  ///< [channel]
};

Left left_by(const State& state, const Likelihood& rows);

/// What commands have beside a plant's controller; a limit that the plant has keeps back the whole.
void take_laws(const State& recorder, State& state);

struct View {
  const physics::Plant& given;
  const physics::Plant& improved;
  const Likelihood& rows;  ///< the held-out ones; those that were fitted where none were held out
  bool held_out = false;
  std::vector<ByRecording> before, after;             ///< left by `given` and by `improved`
  std::vector<std::optional<double>> drawn_constant;  ///< [channel], of `before`
  /// `after`, less what the recorder adds (a late effort) and no plant has.
  std::vector<ByRecording> beside_recorder;
};

/// `improved`: what the findings make of `given`; both must outlive the view. `recorder`: whose
/// circumstances the recordings have; none where nothing is known of them.
View view_of(const physics::Plant& given, const physics::Plant& improved, const Likelihood& rows,
             bool held_out, const State* recorder = nullptr);

/// Of all recordings.
std::size_t used_row_count(const Channel& channel);
/// Used rows of one channel, recordings one after the other.
Eigen::VectorXd used_rows(const Channel& channel, const ByRecording& values);
/// Root of their mean square; 0 without any.
double rms(const Channel& channel, const ByRecording& values);

/// "transmission", "drive" or "command".
std::string stage_of(const Channel& channel);
/// Whether any channel shows that stage of the joint.
bool shown(const Likelihood& rows, std::size_t joint, std::string_view stage);
/// "rad" or "m", and "N_m" or "N".
std::string position_unit_of(const physics::Joint& joint);
std::string effort_unit_of(const physics::Joint& joint);
/// The one of the two that the channel has.
std::string unit_of(const Channel& channel, const physics::Plant& plant);

/// Whether a finding's joint and stage are those of the channel.
template <typename Finding>
bool stands_in(const View& view, const Channel& channel, const Finding& finding) {
  return view.given.joints[channel.joint].name == finding.joint &&
         stage_of(channel) == finding.stage;
}

}  // namespace ravencal::diagnose
