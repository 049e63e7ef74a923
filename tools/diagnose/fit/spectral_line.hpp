// SPDX-License-Identifier: Apache-2.0
//
// A tone in a residual: one frequency that stands out of the noise around it all the time, and not
// because the motion has it. No effect of the vocabulary makes one.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace ravencal::diagnose {

struct SpectralLine {
  double hz = 0.0;
  double rms = 0.0;    ///< of the tone
  double share = 0.0;  ///< of the residual's squared sum
};

/// Tone in `residual` at times `t_s` (rising, gaps allowed), tested over 0.1 to 5 Hz at chance
/// `alpha` over all frequencies; a frequency that stands out of `motion` as well is none.
std::optional<SpectralLine> find_line(const Eigen::VectorXd& t_s, const Eigen::VectorXd& residual,
                                      const Eigen::VectorXd& motion, double alpha);

}  // namespace ravencal::diagnose
