// SPDX-License-Identifier: Apache-2.0
//
// Placebos: a channel made anew with nothing left out. What is named in one is a false alarm.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// What placebos of a channel are made of.
struct PlaceboParts {
  Eigen::VectorXd prediction;  ///< of the plant as refitted, all rows
  Eigen::VectorXd noise;       ///< held-out residual with everything found, at the training rows
  Blocks blocks;
};

PlaceboParts placebo_parts(const ChannelFit& fit);

/// The channel's own motion and noise with nothing left out: plant as refitted, floor with the
/// signs of whole blocks drawn anew.
Series placebo_series(const Series& series, const PlaceboParts& parts, std::uint64_t seed);

}  // namespace ravencal::diagnose
