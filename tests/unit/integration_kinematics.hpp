// SPDX-License-Identifier: Apache-2.0
//
// Cable coupling, forward and inverse kinematics of the look-alike controller, written after the
// facts of the RAVEN-II controller and apart from shared/physics. C++98.
#pragma once

#include <math.h>

#include "unit/integration_structures.hpp"

namespace LOOKALIKE {

const double kPi = 3.14159265358979323846;
const float kCountsPerRad = static_cast<float>(4000.0 / (2.0 * kPi));
// Transmission ratios and cable coupling of the real robot; the tool's joints are not coupled here.
const float kRatio[8] = {136.196255507F, 121.522074965F, 2158.590308370F, 1.0F,
                         5.395176252F,   8.991960421F,   8.991960421F,    8.991960421F};
const float kCoupling01 = 0.14545F, kCoupling02 = 0.0077973826F, kCoupling12 = 0.008077387F;
const float kHome[8] = {0.5235988F, 1.5707963F, 0.40F, 0.0F, 0.0F, 0.0F, 0.7853982F, 0.7853982F};

inline void forward_coupling(mechanism& m) {
  for (int j = 0; j < 8; ++j) m.joint[j].jpos = m.joint[j].mpos / kRatio[j];
  m.joint[1].jpos -= kCoupling01 * m.joint[0].jpos;
  m.joint[2].jpos -= kCoupling02 * m.joint[0].jpos + kCoupling12 * m.joint[1].jpos;
}

inline void inverse_coupling(mechanism& m) {
  for (int j = 0; j < 8; ++j) m.joint[j].mpos_d = kRatio[j] * m.joint[j].jpos_d;
  m.joint[1].mpos_d = kRatio[1] * (m.joint[1].jpos_d + kCoupling01 * m.joint[0].jpos_d);
  m.joint[2].mpos_d = kRatio[2] * (m.joint[2].jpos_d + kCoupling02 * m.joint[0].jpos_d +
                                   kCoupling12 * m.joint[1].jpos_d);
}

// Forward kinematics after Craig, with the link twists, offsets and lengths of r2_kinematics.cpp.
struct pose {
  double r[3][3];
  double p[3];
};

inline void turn_and_move(pose& to, double alpha, double a, double theta, double d) {
  const double ca = cos(alpha), sa = sin(alpha), ct = cos(theta), st = sin(theta);
  const double link[3][3] = {{ct, -st, 0.0}, {st * ca, ct * ca, -sa}, {st * sa, ct * sa, ca}};
  const double offset[3] = {a, -sa * d, ca * d};
  pose next;
  for (int i = 0; i < 3; ++i) {
    next.p[i] = to.p[i];
    for (int k = 0; k < 3; ++k) {
      next.p[i] += to.r[i][k] * offset[k];
      next.r[i][k] = 0.0;
      for (int m = 0; m < 3; ++m) next.r[i][k] += to.r[i][m] * link[m][k];
    }
  }
  to = next;
}

const double kTwistGold[6] = {0.0, 75.0, 128.0, 0.0, 90.0, 90.0};
const double kTwistGreen[6] = {180.0, 75.0, 52.0, 0.0, 90.0, 90.0};
const double kOffsetGold[6] = {205.0, 180.0, 90.0, 0.0, -90.0, 0.0};
const double kOffsetGreen[6] = {25.0, 0.0, -90.0, 0.0, -90.0, 0.0};
const double kDeg = kPi / 180.0;
const double kToolLength = -0.47;   // d4, m
const double kWristLength = 0.013;  // Lw, m

inline void forward_kinematics(bool is_gold, const float* joints, position& where,
                               orientation& how) {
  const double angle[6] = {static_cast<double>(joints[0]),
                           static_cast<double>(joints[1]),
                           0.0,
                           static_cast<double>(joints[4]),
                           static_cast<double>(joints[5]),
                           0.5 * static_cast<double>(joints[7] - joints[6])};
  pose tip = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, {0.0, 0.0, 0.0}};
  for (int i = 0; i < 6; ++i) {
    const double d = i == 2 ? static_cast<double>(joints[2]) : i == 3 ? kToolLength : 0.0;
    turn_and_move(tip, (is_gold ? kTwistGold : kTwistGreen)[i] * kDeg, i == 5 ? kWristLength : 0.0,
                  angle[i] + (is_gold ? kOffsetGold : kOffsetGreen)[i] * kDeg, d);
  }
  where.x = static_cast<int>(tip.p[0] * 1e6);
  where.y = static_cast<int>(tip.p[1] * 1e6);
  where.z = static_cast<int>(tip.p[2] * 1e6);
  for (int i = 0; i < 9; ++i) how.R[i / 3][i % 3] = static_cast<float>(tip.r[i / 3][i % 3]);
}

inline bool is_gold(const mechanism& m) { return m.joint[0].type / 8 % 2 == 0; }

inline void kinematics(mechanism& m) {
  float joints[8];
  for (int j = 0; j < 8; ++j) joints[j] = m.joint[j].jpos;
  forward_kinematics(is_gold(m), joints, m.pos, m.ori);
  for (int i = 0; i < 6; ++i) m.r2_jac.velocity[i] = m.joint[i % 3].jvel + static_cast<float>(i);
  m.r2_jac.is_computed = true;
}

}  // namespace LOOKALIKE
