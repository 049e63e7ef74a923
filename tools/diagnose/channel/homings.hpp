// SPDX-License-Identifier: Apache-2.0
//
// Constants of homings. A plant that draws a constant at each homing says nothing of its
// size, so that each recording has one of its own. None tells anything of the physics, and none is
// an error.
#pragma once

#include <memory>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// The series, with the mean error of each recording taken out where the plant draws a constant at
/// homing and there are several recordings. Held-out ones stay as they are: nobody knows their
/// constants beforehand.
std::shared_ptr<Series> homed_series(const Series& series, const physics::Plant& plant);

/// That error at all rows, beside the constant of each recording where the plant draws one at
/// homing: the mean of the rows that a fit saw or, of a recording that no fit saw, of all of its
/// rows.
Eigen::VectorXd beside_homings(const Series& series, Eigen::VectorXd error);

/// Error at all rows of the plant as it is, and of what was found, beside such constants.
Eigen::VectorXd error_of_plant(const ChannelFit& fit);
Eigen::VectorXd error_of_findings(const ChannelFit& fit);

/// Takes out what the fit, with all that it explains, leaves of the constants; true if that was
/// more than a tenth of the floor, so that another fit says something new.
bool take_out_homings(ChannelFit& fit);

}  // namespace ravencal::diagnose
