// SPDX-License-Identifier: Apache-2.0
//
// What is asked of the recordings before anything is made of them, and what must be said of them:
// nothing is taken for granted, left out or replaced in silence.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

using Recordings = std::vector<record::Recording>;

/// All recordings, held-out ones last.
std::vector<const record::Recording*> in_order(const Recordings& training,
                                               const Recordings& held_out);

/// Name of the recording's file without its folder.
std::string file_name(const record::Recording& recording);

/// From its first row to its last; 0 without rows.
double recorded_s(const record::Recording& recording);

/// A sensor's or another motor's effort, which may load any joint.
bool is_effort_of_no_joint(const record::Channel& channel);

/// True for what a diagnosis may use: channels of joints, loads and sensors' efforts.
/// A robot's recording has hundreds of others, which need not be read.
bool looks_at(const record::Channel& channel);

/// Every role in a unit in which the plant can take it, every load from outside that the plant
/// names, and `held_out_from_s` within a recording. Errors: kUsage, kData.
core::Status check_input(const Recordings& training, const Recordings& held_out,
                         const physics::Plant& plant, std::optional<double> held_out_from_s);

/// What was assumed of the recordings: times, unreadable rows, recordings that end before
/// `held_out_from_s`.
std::vector<std::string> input_notes(const Recordings& training, const Recordings& held_out,
                                     std::optional<double> held_out_from_s);

/// Another simulator's recording at the times of the real one, linear between its rows, NaN beyond
/// them. Its motion may differ from the robot's, which is what a diagnosis is about; its command
/// may not. Errors (kData): too little of the recording is covered, or the desired positions are of
/// another motion.
core::Result<record::Recording> at_times_of(const record::Recording& real,
                                            const record::Recording& simulated,
                                            std::vector<std::string>& notes);

/// "one (joint_estimate, drive_torque), two (joint_estimate)": what the recordings have of each
/// joint; "nothing of any joint" if there is none.
std::string recorded_joints(const Recordings& training);

}  // namespace ravencal::diagnose
