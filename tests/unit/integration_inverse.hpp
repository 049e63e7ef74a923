// SPDX-License-Identifier: Apache-2.0
//
// Inverse kinematics of the look-alike controller, derived from the forward ones of
// integration_kinematics.hpp. Like the controller's they choose among eight solutions the nearest
// to the measured joints, and fail near the remote centre. C++98.
#pragma once

#include "unit/integration_kinematics.hpp"

namespace LOOKALIKE {

// Shoulder, elbow, insertion, roll, wrist and the middle of the jaws.
struct six_joints {
  double value[6];
};

inline double nearest_turn(double angle, double reference) {
  return angle + 2.0 * kPi * floor((reference - angle) / (2.0 * kPi) + 0.5);
}

inline pose pose_of(const position& where, const orientation& how) {
  pose tip;
  tip.p[0] = where.x * 1e-6;
  tip.p[1] = where.y * 1e-6;
  tip.p[2] = where.z * 1e-6;
  for (int i = 0; i < 9; ++i) tip.r[i / 3][i % 3] = static_cast<double>(how.R[i / 3][i % 3]);
  return tip;
}

// Joints 4 to 6 from those before them.
inline void solve_tool(bool is_gold, const pose& tip, double theta1, double theta2,
                       double insertion, double theta[6]) {
  const double* const twist = is_gold ? kTwistGold : kTwistGreen;
  const double theta3 = (is_gold ? kOffsetGold : kOffsetGreen)[2] * kDeg;
  pose third = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, {0.0, 0.0, 0.0}};
  turn_and_move(third, twist[0] * kDeg, 0.0, theta1, 0.0);
  turn_and_move(third, twist[1] * kDeg, 0.0, theta2, 0.0);
  turn_and_move(third, twist[2] * kDeg, 0.0, theta3, insertion);
  double x[3] = {0.0, 0.0, 0.0}, z[3] = {0.0, 0.0, 0.0}, p[3] = {0.0, 0.0, 0.0};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      x[i] += third.r[k][i] * tip.r[k][0];
      z[i] += third.r[k][i] * tip.r[k][2];
      p[i] += third.r[k][i] * (tip.p[k] - third.p[k]);
    }
  }
  const double c5 = -z[2], s5 = (p[2] - kToolLength) / kWristLength;
  double c4 = z[0] * s5, s4 = z[1] * s5;
  if (fabs(c5) > fabs(s5)) {
    c4 = p[0] * c5;
    s4 = p[1] * c5;
  }
  theta[3] = atan2(s4, c4);
  theta[4] = atan2(s5, c5);
  const double cos4 = cos(theta[3]), sin4 = sin(theta[3]);
  theta[5] = atan2(sin4 * x[0] - cos4 * x[1], s5 * x[2] + c5 * (cos4 * x[0] + sin4 * x[1]));
}

// Shoulder and elbow that point the insertion axis at the wrist; false where none does.
inline bool solve_direction(bool is_gold, const double wrist[3], double along, int side,
                            double theta[6]) {
  const double* const twist = is_gold ? kTwistGold : kTwistGreen;
  const double up = cos(twist[0] * kDeg);
  const double c12 = cos(twist[1] * kDeg), s12 = sin(twist[1] * kDeg);
  const double c23 = cos(twist[2] * kDeg), s23 = sin(twist[2] * kDeg);
  const double axis[3] = {wrist[0] / along, wrist[1] / along, wrist[2] / along};
  double cosine = (c12 * c23 - up * axis[2]) / (s12 * s23);
  if (cosine > 1.0 + 1e-6 || cosine < -1.0 - 1e-6) return false;
  if (cosine > 1.0) cosine = 1.0;
  if (cosine < -1.0) cosine = -1.0;
  theta[1] = side * acos(cosine);
  const double x = sin(theta[1]) * s23;
  const double y = -cosine * c12 * s23 - s12 * c23;
  theta[0] = atan2(up * axis[1], axis[0]) - atan2(y, x);
  return true;
}

// False near the remote centre and where no solution is near `measured`.
inline bool inverse_kinematics(bool is_gold, const pose& tip, const six_joints& measured,
                               six_joints& solution) {
  const double* const offset = is_gold ? kOffsetGold : kOffsetGreen;
  double centre[2] = {0.0, 0.0};  // of the remote centre, in the tool's frame
  for (int k = 0; k < 3; ++k) {
    centre[0] -= tip.r[k][0] * tip.p[k];
    centre[1] -= tip.r[k][1] * tip.p[k];
  }
  const double size = sqrt(centre[0] * centre[0] + centre[1] * centre[1]);
  double least = kPi;  // the controller's limit
  bool found = false;
  for (int choice = 0; choice < 8; ++choice) {
    const double flip = choice & 1 ? kWristLength : -kWristLength;
    double wrist[3];
    double distance = 0.0;
    for (int k = 0; k < 3; ++k) {
      wrist[k] = tip.p[k] + flip * (tip.r[k][0] * centre[0] + tip.r[k][1] * centre[1]) / size;
      distance += wrist[k] * wrist[k];
    }
    distance = sqrt(distance);
    if (distance <= kWristLength) return false;
    const double along = choice & 2 ? distance : -distance;
    double theta[6] = {0.0, 0.0, along - kToolLength, 0.0, 0.0, 0.0};
    if (!solve_direction(is_gold, wrist, along, choice & 4 ? 1 : -1, theta)) continue;
    solve_tool(is_gold, tip, theta[0], theta[1], theta[2], theta);
    double difference = 0.0;
    six_joints joints;
    for (int j = 0; j < 6; ++j) {
      joints.value[j] =
          j == 2 ? theta[2] : nearest_turn(theta[j] - offset[j] * kDeg, measured.value[j]);
      const double apart = (j == 2 ? 100.0 : 1.0) * (joints.value[j] - measured.value[j]);
      difference += apart * apart;
    }
    if (difference >= least) continue;
    least = difference;
    solution = joints;
    found = true;
  }
  return found;
}

}  // namespace LOOKALIKE
