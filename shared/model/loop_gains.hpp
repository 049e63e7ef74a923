// SPDX-License-Identifier: Apache-2.0
//
// How strongly a correction answers to the inputs that answer to it: the linearised gains of the
// loop that such inputs close, and the margins of that loop (model/jacobian.hpp computes the
// gains).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/kinds.hpp"

namespace ravencal::model {

/// Of the loop through servo and correction. Infinity where nothing ever limits it.
struct LoopMargins {
  double gain = 0.0;       ///< the factor by which the correction may grow before the loop rings
  double phase_rad = 0.0;  ///< the phase lag that may be added before it rings; at most pi
};

struct LoopGains {
  std::uint32_t rows = 0;             ///< over which the largest were taken
  std::vector<std::string> channels;  ///< that answer; empty if read back from a blob
  /// [outputs x channels] largest |d output / d channel|, SI unit of the output per SI unit of the
  /// channel, all lags, plays and means of the channel added up by their size.
  Eigen::MatrixXd largest;
  /// [outputs x kLoopGroupCount] largest |d output / d channel| of the group times the channel's
  /// standard deviation in the training: SI unit of the output. So N m and DAC counts compare.
  Eigen::MatrixXd by_group;
  std::optional<LoopMargins> margins;  ///< where a plant was given
};

inline constexpr std::array<std::string_view, kLoopGroupCount> kLoopGroupNames = {
    "torque", "velocity", "desired position"};

}  // namespace ravencal::model
