// SPDX-License-Identifier: Apache-2.0
//
// The constant of a homing from one known pose: what the robot's reading lacks of the pose, beside
// what the weights predict there. A constant that a homing cannot have left is refused: the pose,
// not the homing, is then likely to be wrong. Pure functions, any thread.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/homing_constants.hpp"
#include "rezero/pose.hpp"
#include "rezero/reading.hpp"

namespace ravencal::rezero {

/// One joint, SI. A joint that the pose does not name has neither pose nor constant.
struct JointConstant {
  std::string joint;
  std::string unit;
  bool is_known = false;       ///< the pose names it
  double pose = 0.0;           ///< true joint
  double uncertainty = 0.0;    ///< of the pose
  double reading = 0.0;        ///< the robot's own value
  double predicted = 0.0;      ///< what the weights add
  double constant = 0.0;       ///< pose - reading - predicted
  double bound = 0.0;          ///< the largest that is taken; 0: not known
  double expected_rest = 0.0;  ///< error of the constant: of the pose, and of the weights there
};

struct Judgement {
  std::vector<JointConstant> joints;  ///< as in the reading
  std::vector<std::string> refusals;  ///< sentences; none: the constant may be taken
};

/// Largest minus smallest reading of a robot that stands, about what is left of the error of a
/// joint after its calibration.
inline constexpr double kStill_rad = 1.7e-3;  // 0.1 deg
inline constexpr double kStill_m = 1e-4;

/// `seen`: of the training; empty where the weights do not say. `at_most`: bounds of the user,
/// which only lower those of the training, and stand in where it has none.
Judgement judge(const Reading& reading, std::span<const KnownJoint> pose,
                std::span<const model::HomingConstants> seen, std::span<const JointValue> at_most);

/// A table of the joints in the units in which people read them.
std::string table_of(const Judgement& judgement);

}  // namespace ravencal::rezero
