// SPDX-License-Identifier: Apache-2.0
//
// In which circumstances the rows of a view were recorded.
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/explain/view.hpp"

namespace ravencal::diagnose {

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

/// Whether a finding's joint and stage are those of the channel.
template <typename Finding>
bool stands_in(const View& view, const Channel& channel, const Finding& finding) {
  return view.given.joints[channel.joint].name == finding.joint &&
         stage_of(channel) == finding.stage;
}

}  // namespace ravencal::diagnose
