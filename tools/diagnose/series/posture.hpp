// SPDX-License-Identifier: Apache-2.0
//
// Where an arm is as far as its weight is concerned.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ravencal::diagnose {

/// Believed positions, [joints][rows], with what their encoders say of homing, gain and coupling:
/// degrees of them turn the arm against gravity. `truth` is empty where a joint has no encoder, NaN
/// where it was not read; `recording` numbers the homing of each row. Only what is linear in the
/// believed positions is taken over, recording by recording, so that no encoder's noise is in a
/// prediction.
std::vector<Eigen::VectorXd> posture_of(const std::vector<Eigen::VectorXd>& believed,
                                        const std::vector<Eigen::VectorXd>& truth,
                                        const std::vector<int>& recording);

}  // namespace ravencal::diagnose
