// SPDX-License-Identifier: Apache-2.0
//
// What a plant says of a recording whose motors are forced to move as they did: the effort that
// each drive was asked for, where each joint was, and what the controller's law asks for. The
// element functions are those of the simulated arm (ArmPhysics); cables balance at every row
// (CableReplay), and links are accelerated as the joints would be without stretch.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/motion.hpp"
#include "physics/plant.hpp"
#include "physics/predict/link_loads.hpp"

namespace ravencal::physics {

/// Recorded motion of the motors. One value per row everywhere.
struct ForcedMotion {
  Eigen::VectorXd t_s;
  std::vector<char> fresh;     ///< 1 where a recording or an episode starts
  std::vector<Motion> motors;  ///< [joints]: motor angle over nominal reduction, rad or m
  /// Measured loads from outside (Joint::external_load), [joints]; empty where none was recorded.
  std::vector<Eigen::VectorXd> external_loads{};
  /// A recorded load that an effect names; empty if there is none of that name.
  std::function<Eigen::VectorXd(const std::string&)> load{};
  /// Motor positions count from the plant's stops, where homing found them.
  bool homed = false;
  double truth_lateness_s = 0.0;  ///< of the external encoders' time stamps
};

/// A jump of the transmission: `size` (rad or m) from `t_s` on.
struct Jump {
  double size = 0.0;
  double t_s = 0.0;
};

/// What a joint has in one recording and no plant states.
struct JointCircumstances {
  Jump slip;                 ///< the cable slips: the joint moves, its motor does not
  Jump lost_counts;          ///< the motor's encoder loses counts: its reading jumps, nothing moves
  double creep_start = 1.0;  ///< share of its equilibrium that creep has at a start
  double encoder_offset = 0.0;     ///< of the external encoder, rad or m
  double encoder_ramp = 0.0;       ///< of it from the first row to the last
  double effort_lateness_s = 0.0;  ///< of the recorded effort
  double truth_lateness_s = 0.0;   ///< of the external encoder, beyond ForcedMotion's
  /// Of a cable that other joints move: 1 through their links, 0 through their drives. Without it
  /// the plant says so.
  std::optional<double> link_share{};
};

/// Per joint [joints], one value per row; units of the joints.
struct Prediction {
  std::vector<Eigen::VectorXd> effort;    ///< asked of the drive, at the joint: N m or N
  std::vector<Eigen::VectorXd> position;  ///< of the joint as its encoder shows it: rad or m
  std::vector<Eigen::VectorXd> tension;   ///< through its cable: N m or N
  std::vector<Eigen::VectorXd> hanging;   ///< of the joint itself
};

/// What a change of a number of one joint changes in a prediction; each includes those before it.
enum class Reach {
  kPosition,  ///< the joint's position
  kDrive,     ///< the joint's effort
  kCable,     ///< its cable, hence both, and whatever its cable acts on
  kLinkLoad,  ///< the loads of all joints that carry its link, hence their cables
  kEverything,
};

class Predictor {
 public:
  /// Links are where the plant without stretch holds them, until they are moved.
  Predictor(const Plant& plant, ForcedMotion forced, Masses masses);

  /// Links weigh where they are: [joints], rad or m.
  void move_links(const std::vector<Eigen::VectorXd>& positions);

  /// `plant` may differ from the constructor's in numbers and effects, without frames not in the
  /// centres of mass and the moments of its links. `circumstances`: [joints], or empty.
  [[nodiscard]] Prediction predict(const Plant& plant,
                                   const std::vector<JointCircumstances>& circumstances = {}) const;

  /// Brings `prediction` of another plant up to date with `plant`, which differs from it in numbers
  /// of that joint and reach only.
  void update(const Plant& plant, const std::vector<JointCircumstances>& circumstances,
              std::size_t joint, Reach reach, Prediction& prediction) const;

  [[nodiscard]] const ForcedMotion& forced() const { return forced_; }
  /// Joints as the controller believes them, [joints].
  [[nodiscard]] const std::vector<Eigen::VectorXd>& believed() const { return believed_; }
  /// Effort that the plant's links and measured loads from outside ask of the joint.
  [[nodiscard]] Eigen::VectorXd link_load(const Plant& plant, std::size_t joint) const;

 private:
  ForcedMotion forced_;
  std::vector<Eigen::VectorXd> believed_;
  std::vector<Motion> links_;
  LinkLoads loads_;
};

/// The plant's prediction with its links where it holds them. Errors (kData): an effect names a
/// load that was not recorded.
core::Result<Prediction> predict(const Plant& plant, const ForcedMotion& forced);

}  // namespace ravencal::physics
