// SPDX-License-Identifier: Apache-2.0
//
// The fourth gate: a true effect keeps its size at all speeds, loads, positions, directions and
// times; a proxy does not.
#pragma once

#include <string>
#include <vector>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

struct SplitScale {
  std::string regime;  ///< e.g. "speed: high"
  double scale = 1.0;  ///< factor of the effect's fitted contribution in this half of the data
  double error = 0.0;  ///< one standard error, blocks as observations
};

struct Invariance {
  double spread = 0.0;        ///< largest difference of two halves' scales
  double z = 0.0;             ///< of that difference
  double least_z = kProxy_z;  ///< z that counts as more than chance, with few blocks more
  std::string worst;          ///< circumstance of that difference
  std::vector<SplitScale> scales;

  /// By how much the scale differs between circumstances beyond what chance makes of it: one
  /// standard deviation (DerSimonian and Laird 1986, two halves), of the circumstance with the
  /// most.
  [[nodiscard]] double deviation() const;

  /// The sizes differ by too much, and by more than chance.
  [[nodiscard]] bool is_proxy() const { return spread > kProxySpread && z > least_z; }
};

/// `coefficients` of the joint fit of all model.columns().
Invariance invariance_of(const ChannelModel& model, const Eigen::VectorXd& coefficients,
                         std::size_t chosen);

}  // namespace ravencal::diagnose
