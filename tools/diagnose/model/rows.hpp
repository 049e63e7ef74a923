// SPDX-License-Identifier: Apache-2.0
//
// Which rows of a recording a channel uses, and which of them it doubts.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "diagnose/model/noise.hpp"
#include "diagnose/track/track.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

enum class ChannelKind { kPosition, kDrive, kLaw };

/// One row per width of the filter, away from starts, from lost values and, in drives, from rest.
/// Rows near reversals are doubted.
NoiseRows rows_of(const Track& track, std::size_t joint, ChannelKind kind,
                  const physics::Plant& plant);

/// Rows within whose filter a value of the signal was lost become unused.
void leave_out_lost(const Track& track, const Eigen::VectorXd& signal, std::vector<char>& used);

}  // namespace ravencal::diagnose
