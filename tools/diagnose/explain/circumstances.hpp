// SPDX-License-Identifier: Apache-2.0
//
// In which circumstances rows were recorded: where, how fast and under which load a joint moved,
// and how the joints beside it did.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Share of the usual speed below which a joint rests.
inline constexpr double kRestOfUsualSpeed = 0.02;

/// What physics of any name may depend on.
struct Circumstance {
  std::string name;   ///< "position", "velocity", "acceleration", "load", "position of q5", ...
  ByRecording value;  ///< [recording][row]; rates through the filter of the residuals
};

struct Circumstances {
  std::vector<Circumstance> own;     ///< position, velocity, acceleration, and the load if known
  std::vector<Circumstance> others;  ///< positions and velocities of the other joints
};

/// Of the motor for a drive and its command, of the joint for its position. The load is the tension
/// of the cable that `plant` predicts.
Circumstances circumstances_of(const Channel& channel, const Likelihood& rows,
                               const physics::Plant& plant);

/// Of the used rows of one channel, in the order of used_rows(). The joint's own units.
struct ChannelRows {
  Eigen::VectorXd t_s;             ///< in its recording
  Eigen::VectorXd position_ji;     ///< of the motor, at the joint
  Eigen::VectorXd speed_ji_per_s;  ///< signed
  Eigen::VectorXd load_ji;         ///< effort through the transmission; empty: the plant knows none
  Eigen::VectorXd hold_s;          ///< since the motor stopped; 0 in motion
  std::vector<int> blocks;         ///< Likelihood::blocks
  std::vector<std::size_t> recordings;

  [[nodiscard]] Eigen::Index rows() const { return t_s.size(); }
};

/// Effort through the transmission of each joint by the given plant, filtered: [joint][recording].
/// Empty where it is nothing.
std::vector<ByRecording> transmitted_loads(const View& view);

ChannelRows channel_rows(const View& view, std::size_t channel,
                         const std::vector<ByRecording>& loads);

// A true effect keeps its size at all speeds, loads and directions; a proxy does not.

/// Factor of the contribution in each half of a circumstance, beside a free constant; a
/// circumstance in whose halves it cannot be seen has none. Two entries each, low and high.
/// `contribution`: what the effect adds to the prediction; `left`: of the error with it.
std::vector<RegimeScale> scales_of(const std::string& effect, const Eigen::VectorXd& contribution,
                                   const Eigen::VectorXd& left, const ChannelRows& at);

/// Largest difference between the factors of two halves.
double spread_of(const std::vector<RegimeScale>& scales);

}  // namespace ravencal::diagnose
