// SPDX-License-Identifier: Apache-2.0
//
// Gain and phase margin of the loop that a model closes through its inputs and the servo.
//
// Linearised at a row, the model adds the correction e = sum over its inputs u of G_u u (G_u:
// column of its Jacobian), and every u answers to e as ServoLoop says. The loop's transfer is the 3
// x 3 matrix
//
//     L(z) = sum over u of G_u R_u(z) F_u(z)
//
// where F_u is what the input makes of its channel: z^-n for a lag of n control cycles, a / (1 -
// (1 - a) / z) for an exponential mean over time of gain a, and 1 otherwise, the most that a play
// or a mean over travel does (its position is no part of it). A mean of the absolute value has that
// of the mean with the sign of the channel, which the rows do not tell: both signs are tried, the
// same one for all such inputs.
//
// The feedback is positive: the closed loop has the characteristic equation det(I - L(z)) = 0.
// Generalised Nyquist (MacFarlane and Postlethwaite, Int. J. Control 25, 1977): with the
// eigenvalues of L along the unit circle, the critical point is +1. The servo alone is stable, so
// the smallest factor k at which k L has an eigenvalue of +1 is the gain margin: 1 over the largest
// crossing of the positive real axis. The phase margin is the smallest angle from the positive real
// axis at which an eigenvalue has the size 1; lag and lead are counted alike.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "loop/servo_loop.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::loop {

/// Least margins of a loop on a robot. Customary gain margins are 2 to 5, phase margins 30 to 60
/// degrees (K. J. Astrom and T. Hagglund, Advanced PID Control, 2006).
inline constexpr double kLeastGainMargin = 2.0;
inline constexpr double kLeastPhaseMarginRad = 0.7853981633974483;

/// Rows at which a model is linearised at most.
inline constexpr Eigen::Index kRows = 1000;
/// Of the grid, logarithmic from kLowestHz to half the control rate; the limit of 0 Hz is added.
inline constexpr int kFrequencies = 240;
inline constexpr double kLowestHz = 0.02;

/// Rows of a model's inputs and where the joints were meanwhile.
struct OperatingPoints {
  model::FeatureMatrix inputs_si;                      ///< [rows x features]
  Eigen::Matrix<double, Eigen::Dynamic, 3> joints_ji;  ///< [rows x 3] rad, rad, m
};

/// Up to kRows rows, evenly drawn from those without a lost value. Errors (kData): a recording
/// lacks the model's channels or jpos of joints 1 to 3; no row is whole.
core::Result<OperatingPoints> operating_points(
    const model::CalibrationModel& model, std::span<const record::Recording* const> recordings);

/// One margin and where it is smallest.
struct Worst {
  double value = 0.0;
  double frequency_hz = 0.0;
  Eigen::Index row = -1;  ///< of the operating points; -1: the eigenvalues never come near
};

struct Margins {
  Worst gain;       ///< a factor; infinity if nothing crosses the positive real axis
  Worst phase_rad;  ///< pi if no eigenvalue reaches the size 1
  std::vector<std::string> left_out;  ///< channels that answer in a way that is not modelled
  [[nodiscard]] bool enough() const {
    return gain.value >= kLeastGainMargin && phase_rad.value >= kLeastPhaseMarginRad;
  }
};

/// Smallest margins over the points. Outputs that are not of joints 1 to 3 are left aside.
Margins margins(const model::CalibrationModel& model, const OperatingPoints& points,
                ServoLoop& servo);

/// Smallest margins over rows of these recordings, with the plant's servo: of its own controller,
/// else of that in which the model's recordings were made; without either, encoder values as old as
/// both branches have them. Errors (kData): the plant lacks a servo or cable; its arm is not the
/// model's; a recording lacks channels.
core::Result<Margins> margins_with(const physics::Plant& plant,
                                   const model::CalibrationModel& model,
                                   std::span<const record::Recording* const> recordings);

/// Two lines: both margins with frequency and row.
std::string describe(const Margins& margins);

}  // namespace ravencal::loop
