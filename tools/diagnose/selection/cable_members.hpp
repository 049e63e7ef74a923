// SPDX-License-Identifier: Apache-2.0
//
// The cable's effects are one mechanism: spring, gap, strands, creep and friction behind it share
// one balance of efforts. A set of them is therefore fitted through one replay, all sizes together;
// a sum of single replays is not what they do together.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnose/selection/selection.hpp"

namespace ravencal::diagnose {

/// One member of the family: physics that the plant lacks, or a number of the plant's cable that
/// may be off.
struct CableMember {
  enum class Kind {
    kCompliance,
    kGap,
    kStrands,
    kCreep,
    kFriction,
    kStiffnessOff,
    kFrictionOff,
    kWeightOff
  };
  Kind kind = Kind::kCompliance;
  std::size_t candidate = 0;  ///< of the channel's model
  /// Logarithms of its numbers, [1 or 2]; of creep also the share that is missing at the start.
  Eigen::VectorXd start;
  Eigen::VectorXd low, high;  ///< limits of those numbers

  [[nodiscard]] bool is_number() const {
    return kind == Kind::kStiffnessOff || kind == Kind::kFrictionOff || kind == Kind::kWeightOff;
  }
  /// Adds the member with these logarithms to the cable.
  void add_to(CableNumbers& cable, const Eigen::VectorXd& log_values) const;
};

/// Members that the model may test; `scale`: size of the error that they are to explain, position.
std::vector<CableMember> cable_members(const ChannelModel& model, double scale);

/// Which member of the family the chosen effect is; none if it is of another kind.
std::optional<CableMember::Kind> cable_kind(const EffectForm& form, const Series& series);

/// A set of members with their numbers.
struct CableSubset {
  std::vector<const CableMember*> members;
  std::vector<Eigen::VectorXd> log_values;  ///< of each member
  double error = 0.0;                       ///< penalised squared error of the thinned fit, per row
};

/// The plant's cable with a set of members added.
CableNumbers cable_with(const Series& series, const CableSubset& subset);

/// Takes the columns of the plant's own cable numbers anew at that cable: beside a gap a number's
/// change has other consequences than without.
void move_nominal(ChannelModel& model, const CableNumbers& cable);

/// The set as effects of the model: each with the change that it adds to those before it.
std::vector<Chosen> chosen_of(const ChannelModel& model, const CableSubset& subset);

}  // namespace ravencal::diagnose
