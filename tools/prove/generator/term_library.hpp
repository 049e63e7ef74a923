// SPDX-License-Identifier: Apache-2.0
//
// The vocabulary as linear terms, computed from recording and plant. The baselines select from
// them, and effects from outside of the vocabulary are compared with them. SI units,
// joint-referred.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "prove/generator/nominal.hpp"
#include "record/recording.hpp"

namespace ravencal::prove {

/// Signals of one joint, thinned; rows with a lost value are left out.
struct Signals {
  Eigen::VectorXd t_s, q, v, a, weight;
  Eigen::VectorXd side;           ///< -1 to 1: direction of motion, through a narrow play
  Eigen::VectorXd truth, effort;  ///< empty where the recording has none
  std::vector<Eigen::VectorXd> others;
  [[nodiscard]] Eigen::Index rows() const { return t_s.size(); }
};
Signals signals_of(const record::Recording& recording, const NominalRobot& plant,
                   std::size_t joint);

/// -1 to 1: which side of a gap of that width the position pushes.
Eigen::VectorXd play(const Eigen::VectorXd& q, double width);
/// Sine and cosine.
Eigen::MatrixXd wave(const Eigen::VectorXd& q, double order);
/// Width of a play that any joint passes at once.
double narrow(const NominalJoint& joint);

/// A linear problem: which of the groups explain y? Columns of `nuisance` are always in.
struct TermLibrary {
  struct Group {
    std::string id;
    Eigen::MatrixXd columns;
  };
  Eigen::VectorXd y;
  Eigen::MatrixXd nuisance;  ///< the plant's own parameters
  std::vector<Group> groups;
  double smallest = 0.0;  ///< RMS below which a term is not worth a name (STLSQ's threshold)
};

/// What a kind makes its groups of.
struct Terms {
  const Signals& s;
  const NominalJoint& joint;
  std::size_t number;            ///< of the joint
  const Eigen::VectorXd& known;  ///< effort that the plant explains; empty for positions
  Eigen::VectorXd t_s = s.t_s.array() - s.t_s[0];
  double whole_s = t_s[t_s.size() - 1];
  std::vector<Eigen::MatrixXd> added{};
  void add(Eigen::MatrixXd columns) { added.push_back(std::move(columns)); }
};

/// Truth minus what plant and motors say; needs `truth`.
TermLibrary position_library(const Signals& signals, const NominalRobot& plant, std::size_t joint);
/// Effort minus what the plant says; needs `effort`.
TermLibrary drive_library(const Signals& signals, const NominalRobot& plant, std::size_t joint);

}  // namespace ravencal::prove
