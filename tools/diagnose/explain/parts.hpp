// SPDX-License-Identifier: Apache-2.0
//
// The parts of a report that are taken from recordings, models and the view of both plants.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "diagnose/explain/models.hpp"
#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"
#include "diagnose/model/likelihood.hpp"
#include "diagnose/track/input.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Adds recordings that have nothing to say of a channel, channels of which no held-out row tells,
/// and signals that the plant's effects follow and nobody recorded. `held_out`: null: none. `all`:
/// recordings in the order of Track::recording.
void add_channel_notes(const Likelihood& fitted, const Likelihood* held_out,
                       const std::vector<const record::Recording*>& all,
                       const physics::Plant& plant, std::vector<std::string>& notes);

/// Every channel that has used rows, and every stage of a joint that has none. Motion and load are
/// those of the rows that were fitted. `held_out`: of the same channels; null: none.
void add_looked_at(const Likelihood& fitted, const Likelihood* held_out,
                   const physics::Plant& given, Report& report);

/// Why that stage ("command", "drive"; anything else is behind the motor) of a joint was not looked
/// at.
std::string why_not(const Likelihood& fitted, std::size_t joint, std::string_view stage);

/// One figure per channel that has used rows, commands apart, and the drive's in percent of its
/// effort. `first_recording`: place of the view's first recording in Report::recordings.
void add_held_out(const View& view, std::size_t first_recording, Report& report);

/// Adds `free_run_1s_rmse` of each joint whose effort was recorded and, where both plants have a
/// controller and a desired position was recorded, `closed_loop_rmse` and `closed_loop_mae`. Adds
/// the drift over 0.5, 1, 2 and 5 s, where the recording has windows of that length. `refitted`:
/// the given plant with its own numbers refitted.
void add_free_run(const View& view, const physics::Plant& refitted, Report& report);

/// Of every drive and position. The floor is what passes in the same circumstances do not share,
/// else what the sensor resolves, else nothing is known of it.
void add_error_left(const View& view, Report& report);

/// `view`: of the rows that were fitted, since moments of others are not among what was found. One
/// mismatch for each channel in which an effect or something unexplained stands. What the
/// improved plant cannot hold is located by the whole error of the given one.
void add_mismatch(const View& view, Report& report);

/// `first_recording`: place of the view's first recording in Report::recordings. Fills in the
/// invariance spread of the effects too.
void add_plots(const View& view, const Growth& growth, std::size_t first_recording, Report& report);

}  // namespace ravencal::diagnose
