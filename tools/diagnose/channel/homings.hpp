// SPDX-License-Identifier: Apache-2.0
//
// Recordings of several homings. A plant that draws a constant at each homing says nothing of its
// size, so that each recording has one of its own, and none tells anything of the physics.
#pragma once

#include <memory>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// The series, with the mean error of each recording taken out where the plant draws a constant at
/// homing and there are several recordings. Held-out ones stay as they are: nobody knows their
/// constants beforehand.
std::shared_ptr<Series> homed_series(const Series& series, const physics::Plant& plant);

/// Takes out what the fit, with all that it explains, leaves of the constants; true if that was
/// more than a tenth of the floor, so that another fit says something new.
bool take_out_homings(ChannelFit& fit);

}  // namespace ravencal::diagnose
