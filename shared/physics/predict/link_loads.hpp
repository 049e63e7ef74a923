// SPDX-License-Identifier: Apache-2.0
//
// What the links of a plant ask of its joints along one motion, for plants that differ from a
// nominal one in what their links weigh or in where their joints stand.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "physics/motion.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// Whether plants that are predicted have other links than the predictor's own: what each number of
/// a link adds is then found beforehand.
enum class Masses { kFixed, kVary };

class LinkLoads {
 public:
  LinkLoads(Plant nominal, Masses masses);

  /// The motion of the links, [joints].
  void move(const std::vector<Motion>& links);

  /// Effort on a joint, one value per row, N m or N. Thread-safe. `plant` differs from the nominal
  /// one in frames only or, with kVary, in masses as well and, where the plant states frames, in
  /// centres of mass and moments.
  [[nodiscard]] Eigen::VectorXd of(const Plant& plant, std::size_t joint) const;

 private:
  using Efforts = std::vector<Eigen::VectorXd>;
  [[nodiscard]] std::shared_ptr<const Efforts> remembered(const Plant& plant) const;
  [[nodiscard]] Efforts efforts(const Plant& plant) const;
  void move_bodies();
  void move_masses();

  Plant nominal_;
  Masses masses_;
  std::vector<Motion> links_;
  /// Of the links as they are or, where masses vary without frames, of their moments alone.
  Efforts of_links_;
  /// Where they vary: what the numbers of links add to the effort on each joint, [joints]. With
  /// frames those are inertial_numbers() of the links that it carries, else the masses of all
  /// links, the payload's last.
  std::vector<Eigen::MatrixXd> per_number_;
  std::vector<std::vector<Eigen::Index>> carried_;  ///< places of those numbers among all links'
  /// Plants that were asked for last; a fit asks for each of them once a joint. Copies share it
  /// until they move.
  struct Recent;
  std::shared_ptr<Recent> recent_;
};

}  // namespace ravencal::physics
