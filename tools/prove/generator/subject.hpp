// SPDX-License-Identifier: Apache-2.0
//
// Concealed effects of a sealed case: effects of the vocabulary (vocabulary_kinds), some that are
// outside of it, and how each enters the truth and leaves the plant.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prove/generator/nominal.hpp"

namespace ravencal::prove {

struct SubjectKind {
  std::string_view id;
  std::string_view stage;      ///< of the report's schema
  std::string_view parameter;  ///< whose value a diagnosis can report; empty: no single one
  bool outside = false;        ///< not in the vocabulary: the right verdict is `unknown`
  bool in_truth = false;       ///< shows in the external encoder, else in the drive's effort
  bool wants_rich = false;     ///< slow motion does not excite it
  char robot = 'b';            ///< 'r' RAVEN only, 'a' single axis only, 'b' both
};

/// The vocabulary without `unknown` and `inertia_error`, which is a parameter case.
std::span<const SubjectKind> vocabulary_kinds();
std::span<const SubjectKind> outside_kinds();

/// One hidden effect. `amplitude` is the value of the kind's parameter (else its natural size).
struct Subject {
  const SubjectKind* kind = nullptr;
  std::size_t joint = 0;
  std::size_t from = 0;  ///< the other joint, where there is one
  double amplitude = 0.0;
  std::map<std::string, double> details;  ///< what else fixes it: order, time, place
  std::vector<std::pair<double, double>> interval_s, position;  ///< where it acts, if local
};

/// Figures of the desired motion of a joint, for choosing amplitudes.
struct MotionFigures {
  double position_rms = 0.0, travel = 0.0, span = 0.0, centre = 0.0, reversals = 0.0;
  double velocity_rms = 0.0, acceleration_rms = 0.0;
  double weight_rms = 0.0, weight_span = 0.0, weight_most = 0.0;
};
std::vector<MotionFigures> motion_figures(const NominalRobot& robot, MotionKind motion,
                                          double duration_s, std::uint64_t motion_seed);

/// Chooses joint and details.
Subject draw_subject(const SubjectKind& kind, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double duration_s, Random& random);

/// RMS of the effect in its channel per unit of amplitude, in closed form and to first order.
double unit_size(const Subject& subject, const NominalRobot& robot,
                 const std::vector<MotionFigures>& figures, double amplitude);
/// Amplitude at which the effect has this RMS; bounded so that the robot still works.
double amplitude_for(const Subject& subject, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double rms);

/// Removes the effect's kind from the plant.
void conceal(const Subject& subject, NominalRobot& nominal);
/// Puts `amplitude` of it into the truth. Zero changes nothing.
void apply(const Subject& subject, double amplitude, const NominalRobot& nominal, Session& session);

}  // namespace ravencal::prove
