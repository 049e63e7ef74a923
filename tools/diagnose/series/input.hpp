// SPDX-License-Identifier: Apache-2.0
//
// What is asked of the input before any series is built, and what must be said of it: nothing is
// taken for granted, left out or replaced in silence.
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "diagnose/series/series.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

using Recordings = std::vector<record::Recording>;

/// Name of the recording's file without its folder.
std::string file_name(const record::Recording& recording);

/// From its first row to its last; 0 without rows.
double recorded_s(const record::Recording& recording);

/// Every role in a unit in which the plant can take it, and every `held_out_from_s` within a
/// recording. Errors: kUsage, kData.
core::Status check_input(const Recordings& training, const Recordings& held_out,
                         const physics::Plant& plant, const SeriesOptions& options);

/// What was assumed of the recordings: times, unreadable rows, recordings that end before
/// `held_out_from_s`.
std::vector<std::string> input_notes(const Recordings& training, const Recordings& held_out,
                                     const SeriesOptions& options);

/// Recordings that have nothing to say of a series, and signals of the plant's effects that none
/// has.
std::vector<std::string> series_notes(const SeriesSet& set, const Recordings& training,
                                      const Recordings& held_out, const physics::Plant& plant);

/// "one (joint_estimate, drive_torque), two (joint_estimate)": what the recordings have of each
/// joint; "nothing of any joint" if there is none.
std::string recorded_joints(const Recordings& training);

}  // namespace ravencal::diagnose
