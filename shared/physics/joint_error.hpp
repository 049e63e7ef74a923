// SPDX-License-Identifier: Apache-2.0
//
// Position of a joint, given that of its drive or its command: the plant's transmission effects, as
// far as they depend on positions and recorded loads alone. Cables that need an effort through them
// belong to the arm's physics (physics/cable.hpp).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// Signals that a joint's error depends on, one value per row.
struct JointSignals {
  Eigen::VectorXd t_s;
  std::vector<char> fresh;   ///< 1 where a recording or an episode starts
  Eigen::VectorXd position;  ///< asked of the joint, rad or m
  /// Position of another joint, or a recorded load; empty if there is none of that name.
  std::function<Eigen::VectorXd(const std::string&)> other;
  /// Position asked of its drive, at the joint, where it is the drive that may lag; else empty.
  Eigen::VectorXd driven{};
};

/// What a reading shows that is `late_s` late (negative: early), between rows on the line; at the
/// ends of a stretch, its first and last row.
Eigen::VectorXd later(const Eigen::VectorXd& t_s, const std::vector<char>& fresh,
                      const Eigen::VectorXd& values, double late_s);

/// The part of the joint's motion that other joints make through its effects, signals that are
/// missing aside. Friction and gaps are the joint's own: their loops follow it wherever it is
/// moved.
Eigen::VectorXd moved_by_others(const Joint& joint, const JointSignals& signals);

/// Errors (kData): a signal that an effect of the joint names is not `recorded`.
core::Status check_signals(const Joint& joint,
                           const std::function<bool(const std::string&)>& recorded);

/// Joint minus `position` where nothing but its own motion says on which side of the gap it is.
Eigen::VectorXd play_error(const Joint& joint, const JointSignals& signals);

/// Joint minus `position`, rad or m, by every effect of the joint that needs no effort to be known.
/// Errors (kData): a signal that an effect names is missing.
core::Result<Eigen::VectorXd> joint_error(const Joint& joint, const JointSignals& signals);

/// The part of it that effects described by their shape alone make: offset, loops and stretch given
/// in positions, stretch per recorded load. Signals that are missing count as zero.
Eigen::VectorXd shape_error(const Joint& joint, const JointSignals& signals);

}  // namespace ravencal::physics
