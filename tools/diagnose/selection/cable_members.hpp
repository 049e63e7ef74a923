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

/// Fits all numbers of a set together with the linear terms of the model (Levenberg-Marquardt on a
/// thinned replay).
class CableFit {
 public:
  /// `rest`: the model without any member of the family; must outlive the object.
  explicit CableFit(const ChannelModel& rest);

  [[nodiscard]] CableSubset fit(const std::vector<const CableMember*>& members) const;

  /// The set with its numbers moved from where they are to where they fit best.
  [[nodiscard]] CableSubset improved(CableSubset start) const;

  /// RMS of what the linear terms alone leave.
  [[nodiscard]] double left() const { return left_; }

 private:
  [[nodiscard]] Eigen::VectorXd change(const CableNumbers& cable) const;
  [[nodiscard]] Eigen::VectorXd step(const CableSubset& subset, const Eigen::VectorXd& now,
                                     double damping) const;
  /// Coefficients of the linear terms within their limits, and what they leave.
  [[nodiscard]] Eigen::VectorXd linear_fit(const Eigen::VectorXd& y) const;
  [[nodiscard]] double error_of(const Eigen::VectorXd& change) const;

  const Series& series_;
  Eigen::VectorXd t_s_, motor_, weight_, inertial_;
  std::vector<char> fresh_;
  std::vector<Eigen::Index> used_;  ///< thinned rows that are fitted
  Eigen::MatrixXd linear_;          ///< at those rows
  Eigen::VectorXd precision_;
  Eigen::VectorXd target_;
  Eigen::MatrixXd normal_;  ///< of the linear terms
  Eigen::VectorXd limit_;   ///< of their coefficients
  Eigen::VectorXd nominal_stretch_;
  double left_ = 0.0;
};

/// The plant's cable with a set of members added.
CableNumbers cable_with(const Series& series, const CableSubset& subset);

/// Takes the columns of the plant's own cable numbers anew at that cable: beside a gap a number's
/// change has other consequences than without.
void move_nominal(ChannelModel& model, const CableNumbers& cable);

/// The set as effects of the model: each with the change that it adds to those before it.
std::vector<Chosen> chosen_of(const ChannelModel& model, const CableSubset& subset);

}  // namespace ravencal::diagnose
