// SPDX-License-Identifier: Apache-2.0
//
// Concealed effects of a sealed case: effects of the vocabulary and some that are outside of it. A
// kind is one row of a table in kinds/, and all that tells it apart from others stands there.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prove/generator/nominal.hpp"

namespace ravencal::prove {

struct SubjectKind;
struct Terms;

using Intervals = std::vector<std::pair<double, double>>;

/// One hidden effect. `amplitude` is the value of the kind's parameter (else its natural size).
struct Subject {
  const SubjectKind* kind = nullptr;
  std::size_t joint = 0;
  std::optional<std::size_t> from{};  ///< the other joint, where there is one
  double amplitude = 0.0;
  std::map<std::string, double> details{};  ///< what else fixes it: sign, order, time, place
  Intervals interval_s{}, position{};       ///< where it acts, if local
};

/// Figures of the desired motion of a joint, for choosing amplitudes.
struct MotionFigures {
  double position_rms = 0.0, travel = 0.0, span = 0.0, centre = 0.0, reversals = 0.0;
  double velocity_rms = 0.0, acceleration_rms = 0.0;
  double weight_rms = 0.0, weight_span = 0.0, weight_most = 0.0;
};
std::vector<MotionFigures> motion_figures(const NominalRobot& robot, MotionKind motion,
                                          double duration_s, std::uint64_t motion_seed);

/// Where a subject is placed, and how that joint moves.
struct Setting {
  const Subject& subject;
  const NominalRobot& robot;
  const std::vector<MotionFigures>& figures;
  const NominalJoint& joint = robot.joints[subject.joint];
  const MotionFigures& motion = figures[subject.joint];
  [[nodiscard]] const MotionFigures& other() const { return figures[*subject.from]; }
};

/// What a kind makes details, intervals and places of; every kind draws the numbers.
struct Draw : Setting {
  Subject& to;
  std::map<std::string, double>& details;
  double duration_s;
  double place, width;  ///< a part of the joint's range
  double at_s;          ///< in the middle of the recording
  double share;         ///< [0, 1)
  Random& random;
};

/// What an effect changes.
struct Truth {
  const Subject& subject;
  double size, signed_size;  ///< amplitude
  Session& session;
  JointPhysics& joint = session.robot.joints[subject.joint];
  CablePhysics& cable = joint.cable;
  DryFriction& dry = joint.motor_friction;
  JointSession& recorded = session.joints[subject.joint];
  [[nodiscard]] double detail(const char* name) const { return subject.details.at(name); }
  [[nodiscard]] double& coupling() const {
    return session.robot.coupling(static_cast<Eigen::Index>(subject.joint),
                                  static_cast<Eigen::Index>(*subject.from));
  }
};

/// Where an effect acts.
struct Stage {
  std::string_view word;  ///< of the report's schema
  bool in_truth;          ///< shows in the external encoder, else in the drive's effort
};
inline constexpr Stage kTransmission{"transmission", true}, kSensor{"sensor", true};
inline constexpr Stage kDrive{"drive", false}, kCommand{"command", false};

enum KindFlag : unsigned {
  kOutside = 1U,      ///< not in the vocabulary: the right verdict is `unknown`
  kWantsRich = 2U,    ///< slow motion does not excite it
  kAtReversals = 4U,  ///< motion that never turns shows an offset, a stiffness or a level
  kEverywhere = 8U,   ///< acts on all joints: the name is right at any of them
  kSigned = 16U,      ///< diagnose prints its value with a sign
  kFactor = 32U,      ///< and as a factor: one and the amplitude
};

struct KindName {
  std::string_view id;
  Stage stage;
  std::string_view parameter;  ///< whose value a diagnosis can report; empty: no single one
  unsigned flags = 0;          ///< of KindFlag
  /// A gross effect may spoil the fit, not the robot: amplitudes at which it follows its command.
  struct Most {
    double rotary = std::numeric_limits<double>::infinity(), prismatic = rotary;
  } most{};
  char robot = 'b';  ///< 'r' RAVEN only, 'a' single axis only, 'b' both
  [[nodiscard]] bool is(KindFlag flag) const { return (flags & flag) != 0; }
};

void any_joint(Subject& subject, std::size_t joints, Random& random);
/// And `from` before it.
void joint_after_another(Subject& subject, std::size_t joints, Random& random);

/// SI units, joint-referred.
struct KindLaws {
  /// Numbers by which a plant states it, and their keys there for both kinds of joint; a plant
  /// whose first one is zero lacks it.
  struct Stated {
    double NominalJoint::*value = nullptr;
    std::string_view rotary{}, prismatic{};
  } stated[2] = {};
  /// Draws `joint` and `from`.
  void (*choose)(Subject& subject, std::size_t joints, Random& random) = any_joint;
  void (*draw)(const Draw& draw) = nullptr;
  /// RMS in its channel per unit of amplitude, in closed form and to first order; else 1.
  double (*unit_rms)(const Setting& setting) = nullptr;
  /// Amplitude of an RMS that is not proportional to it.
  double (*amplitude)(const Setting& setting, double rms) = nullptr;
  /// What else changes in a plant that loses the first one.
  void (*conceal)(NominalJoint& joint) = nullptr;
  void (*apply)(const Truth& truth) = nullptr;
  /// RMS of the controller law's own residual, which the loop does not spread, where that shows it.
  double (*law_rms)(const Subject& subject, double effort_rms, double duration_s) = nullptr;
  /// What the baselines try where the plant does not state it.
  void (*terms)(Terms& terms) = nullptr;

  [[nodiscard]] bool stated_by(const NominalJoint& joint) const {
    return stated[0].value != nullptr && joint.*stated[0].value > 0.0;
  }
};

struct SubjectKind : KindName, KindLaws {};

/// The vocabulary without `unknown` and `inertia_error`, which is a parameter case.
std::span<const SubjectKind> vocabulary_kinds();
std::span<const SubjectKind> outside_kinds();
/// Of either; null: none has that id.
const SubjectKind* kind_of(std::string_view id);

/// Chooses joint and details.
Subject draw_subject(const SubjectKind& kind, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double duration_s, Random& random);

/// Amplitude at which the effect has this RMS; bounded so that the robot still works.
double amplitude_for(const Subject& subject, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double rms);

/// What diagnose would print for a perfect fit.
double reported_value(const Subject& subject);

/// Removes the effect's kind from the plant.
void conceal(const Subject& subject, NominalRobot& nominal);
/// Puts `amplitude` of it into the truth. Zero changes nothing.
void apply(const Subject& subject, double amplitude, Session& session);

}  // namespace ravencal::prove
