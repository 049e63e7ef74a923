// SPDX-License-Identifier: Apache-2.0
//
// Pulses that something adds to the controller's output: stretches of constant disturbance between
// edges of what the control law leaves.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnose/channel/channel.hpp"
#include "diagnose/channel/control_law.hpp"

namespace ravencal::diagnose {

struct Pulse {
  Eigen::Index first = 0;
  Eigen::Index last = 0;  ///< one past the end
  double begin_s = 0.0;
  double end_s = 0.0;
  double size = 0.0;
};

struct Pulses {
  std::vector<Pulse> pulses;
  double baseline = 0.0;   ///< of the law's residual without a pulse
  double threshold = 0.0;  ///< least edge that counts
};

Pulses find_pulses(const Series& series, const ControlLaw& law);

/// Names what was found where chance makes so much of it with no more than `chance`. Returns
/// whether it did.
bool name_pulses(const Pulses& found, const Series& series, const ControlLaw& law, double chance,
                 ChannelFindings& findings);

/// Pulses that it takes at least to tell them from chance.
int least_pulses(double chance);

}  // namespace ravencal::diagnose
