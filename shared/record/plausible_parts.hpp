// SPDX-License-Identifier: Apache-2.0
//
// The parts of plausibility.cpp. Private to record/.
#pragma once

#include <vector>

#include "record/plausibility.hpp"

namespace ravencal::record {

/// Of each joint's truth against its estimate: gain, sign, exchanged joints, offset, relation.
std::vector<Implausibility> doubts_of_truth(const Recording& recording);
/// Of single signals and of those of one side: turns, jumps, frozen values, velocity, effort.
std::vector<Implausibility> doubts_of_signals(const Recording& recording);
/// Of the rows' times.
std::vector<Implausibility> doubts_of_stamps(const Recording& recording);

/// Rows at least 9 ms apart: enough for a joint's motion, at any rate of the recording.
std::vector<Eigen::Index> thinned_rows(const Recording& recording);
/// A column at these rows.
Eigen::VectorXd values_at(const Recording& recording, Eigen::Index column,
                          const std::vector<Eigen::Index>& rows);
/// Largest minus smallest of the values that are not lost; 0 of none.
double travel_of(const Eigen::VectorXd& values);
/// kLeastTravel of a channel's unit; infinite for a unit that is no position's.
double least_travel(const Channel& channel);
/// "12.3 s" after the first row.
std::string moment_of(const Recording& recording, std::int64_t t_ns);
/// "3.4 deg" of a value in SI.
std::string amount_of(double value, const Channel& channel);

}  // namespace ravencal::record
