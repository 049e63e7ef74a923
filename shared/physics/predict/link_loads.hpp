// SPDX-License-Identifier: Apache-2.0
//
// What the links of a plant ask of its joints along one motion, for plants that differ from a
// nominal one in masses or in where their joints stand.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "physics/motion.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// Whether plants that are predicted have other masses than the predictor's own: what a kilogram of
/// each body adds is then found beforehand.
enum class Masses { kFixed, kVary };

class LinkLoads {
 public:
  LinkLoads(Plant nominal, Masses masses);

  /// The motion of the links, [joints].
  void move(const std::vector<Motion>& links);

  /// Effort on a joint, one value per row, N m or N. Thread-safe. `plant` differs from the nominal
  /// one in masses or frames; with kFixed in frames only.
  [[nodiscard]] Eigen::VectorXd of(const Plant& plant, std::size_t joint) const;

 private:
  using Efforts = std::vector<Eigen::VectorXd>;
  [[nodiscard]] std::shared_ptr<const Efforts> elsewhere(const Plant& plant) const;

  Plant nominal_;
  Masses masses_;
  std::vector<Motion> links_;
  /// Efforts of the links as they are or, where masses vary, of their moments alone and per kg of
  /// each link and of the payload last: [joints].
  Efforts of_links_;
  std::vector<Efforts> per_kg_;
  /// Plants with other frames that were asked for last; a fit asks for each of them once a joint.
  /// Copies share it until they move.
  struct Recent;
  std::shared_ptr<Recent> recent_;
};

}  // namespace ravencal::physics
