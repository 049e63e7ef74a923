// SPDX-License-Identifier: Apache-2.0
//
// What has a constant of its own. A joint's zero is found anew at every homing, cables are
// tensioned anew, encoders are mounted anew: the error then differs by a constant that no input
// tells.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "choice/rows.hpp"
#include "choice/trial.hpp"

namespace ravencal::choice {

enum class SessionRule {
  kAuto,       ///< what follows a homing; and a recording without one, where that predicts better
  kRecording,  ///< every recording
  kNone        ///< nothing: one constant
};

/// Sets the sessions of a joint's rows; `known` are those rows among all. "Predicts better": the
/// error of a probe of `columns` on recordings that it was not fitted to, constants included, is
/// smaller beyond the standard error of the difference.
void set_sessions(SessionRule rule, const Rows& all, const std::vector<Eigen::Index>& known,
                  const std::vector<Eigen::Index>& columns, JointRows& rows);

/// Constants of the homings that the sessions show, rising, SI: sessions whose constants differ by
/// less than these are known to are one homing. `constants`: of the sessions that have rows, SI.
/// `left` [rows]: prediction - error of rows that the fit did not see, SI; how far its means over
/// stretches of a session lie apart says how well the session's constant is known.
std::vector<double> homing_constants(const std::vector<double>& constants,
                                     const Eigen::VectorXd& left, const JointRows& rows);

}  // namespace ravencal::choice
