// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/effect_words.hpp"

#include <algorithm>
#include <array>

#include "diagnose/findings/findings.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::diagnose {
namespace {

constexpr std::string_view kTransmission = "transmission", kDrive = "drive", kCommand = "command";

constexpr std::string_view kPressIt =
    "press the joint to and fro by hand or with torque pulses below breakaway: a gap moves without "
    "effort, friction behind a cable does not";
constexpr std::string_view kRecordTheJump =
    "record the drive's command at that moment: lost counts make the servo jump, a slipping cable "
    "does not";

constexpr std::string_view kMeasureTheLink =
    "measure the distance of the two axes: a longer lever and a greater mass weigh alike in one "
    "posture, not in all";

/// A drive that is not fitted at rest has one constant for both.
constexpr std::array<std::string_view, 1> kAsConstantEffort = {"effort_offset"};
constexpr std::array<std::string_view, 1> kAsWeight = {"payload"};
constexpr std::array<std::string_view, 1> kAsLink = {"gravity"};
/// Motor and joint part by as much; only the servo's answer in that moment differs.
constexpr std::array<std::string_view, 1> kAsSlip = {"slip"};
constexpr std::array<std::string_view, 1> kAsLostCounts = {"lost_counts"};

constexpr std::array<EffectWords, 36> kVocabulary = {{
    {.id = "homing_offset",
     .stage = kTransmission,
     .abscissa = Abscissa::kTime,
     .probes = Probe::kHomings,
     .separate_by = "home twice more and record each time: a homing offset changes at the homing "
                    "and at no other time"},
    {.id = "gain_error",
     .stage = kTransmission,
     .probes = Probe::kWholeRange,
     .separate_by =
         "repeat the same motion with 0.5 kg on the tool: a wrong ratio stays, stretch grows"},
    {.id = "coupling",
     .stage = kTransmission,
     .probes = Probe::kOneByOne,
     .separate_by = "move the other joint alone over its range while this joint holds still"},
    {.id = "compliance",
     .stage = kTransmission,
     .abscissa = Abscissa::kLoad,
     .seat = Seat::kBetween,
     .probes = Probe::kLoaded,
     .separate_by = "repeat the same motion with 0.5 kg on the tool: stretch grows with the load, "
                    "a wrong ratio does not"},
    {.id = "backlash",
     .stage = kTransmission,
     .seat = Seat::kBetween,
     .probes = Probe::kLoaded | Probe::kReversals | Probe::kPressed,
     .separate_by = kPressIt},
    {.id = "joint_friction",
     .stage = kTransmission,
     .abscissa = Abscissa::kLoad,
     .seat = Seat::kJoint,
     .probes = Probe::kReversals | Probe::kPressed,
     .separate_by = kPressIt},
    {.id = "hysteresis",
     .stage = kTransmission,
     .abscissa = Abscissa::kLoad,
     .seat = Seat::kBetween,
     .probes = Probe::kLoaded | Probe::kReversals,
     .separate_by = "nested reversals from 0.3 to 12 degrees, and holds of 30 s after a reversal: "
                    "creep relaxes there, hysteresis stays"},
    {.id = "creep",
     .stage = kTransmission,
     .abscissa = Abscissa::kTime,
     .seat = Seat::kBetween,
     .probes = Probe::kHolds,
     .separate_by = "hold a loaded pose for three minutes, then the opposite pose: creep relaxes "
                    "with the load's sign, drift does not"},
    {.id = "eccentricity",
     .stage = kTransmission,
     .probes = Probe::kWholeRange,
     .separate_by = "pass the whole range slowly both ways ten times: a pulley's wave repeats at "
                    "the order of a part in the drawing"},
    {.id = "slip",
     .stage = kTransmission,
     .abscissa = Abscissa::kTime,
     .probes = Probe::kHomings,
     .own_sentence = "the cable slips on its pulley",
     .look_alikes = kAsLostCounts,
     .separate_by = kRecordTheJump},
    {.id = "coulomb_friction",
     .stage = kDrive,
     .origin = Origin::kDriveFriction,
     .abscissa = Abscissa::kSpeed,
     .seat = Seat::kDrive,
     .probes = Probe::kReversals,
     .separate_by =
         "the same motion at three speeds and under two loads: dry friction is the same at all"},
    {.id = "viscous_friction",
     .stage = kDrive,
     .origin = Origin::kDriveFriction,
     .abscissa = Abscissa::kSpeed,
     .seat = Seat::kDrive,
     .probes = Probe::kSpeeds,
     .separate_by = "the same motion at a third and at three times the speed"},
    {.id = "stribeck_friction",
     .stage = kDrive,
     .origin = Origin::kDriveFriction,
     .abscissa = Abscissa::kSpeed,
     .seat = Seat::kDrive,
     .probes = Probe::kSpeeds,
     .separate_by = "passes at 0.1, 0.3 and 1 times the usual speed, and starts from rest"},
    {.id = "presliding",
     .stage = kDrive,
     .origin = Origin::kDriveFriction,
     .seat = Seat::kDrive,
     .probes = Probe::kReversals,
     .separate_by = "reversals of 0.05, 0.2 and 1 degree around one pose"},
    {.id = "asymmetric_friction",
     .stage = kDrive,
     .origin = Origin::kDriveFriction,
     .abscissa = Abscissa::kSpeed,
     .seat = Seat::kDrive,
     .look_alikes = kAsConstantEffort,
     .separate_by = "the same motion with the arm turned over: a load changes its sign, friction "
                    "does not; and the drive at rest with the motor off: an offset of the effort "
                    "stays, friction does not"},
    {.id = "load_dependent_friction",
     .stage = kDrive,
     .origin = Origin::kDriveFriction,
     .abscissa = Abscissa::kLoad,
     .seat = Seat::kDrive,
     .probes = Probe::kLoaded,
     .separate_by = "the same motion with 0, 250 and 500 g on the tool"},
    {.id = "torque_constant",
     .stage = kDrive,
     .abscissa = Abscissa::kSpeed,
     .probes = Probe::kSpeeds | Probe::kWeighed,
     .separate_by = "the same motion with a known weight on the tool: a wrong torque constant "
                    "scales it, a wrong mass adds to it"},
    {.id = "torque_ripple",
     .stage = kDrive,
     .probes = Probe::kWholeRange,
     .separate_by =
         "pass the range slowly both ways at 1 kHz: ripple repeats with the motor's poles"},
    {.id = "effort_offset",
     .stage = kDrive,
     .abscissa = Abscissa::kTime,
     .separate_by =
         "record the drive at rest with the motor off, or the same motion in a second recording"},
    {.id = "saturation",
     .stage = kDrive,
     .probes = Probe::kPulses,
     .separate_by = "record the drive's current as well, or repeat the motion at a third of the "
                    "speed with the weight taken off: friction stays, the limit is not reached"},
    {.id = "controller_gain",
     .stage = kCommand,
     .probes = Probe::kPulses,
     .own_sentence = "the controller's gain is not the plant's",
     .separate_by = "read the gain from the controller's configuration"},
    {.id = "inertia_error",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kSpeeds,
     .own_sentence = "motor and link have another inertia than the plant's",
     .separate_by = "check the plant's number against its source"},
    {.id = "gravity",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kLoaded | Probe::kWeighed,
     .look_alikes = kAsWeight,
     .separate_by = "the same motion with 0 and 500 g on the tool: weight adds in proportion, "
                    "cables that pull with posture do not"},
    {.id = "centre_of_mass",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kLoaded,
     .own_sentence = "the joint's link has its centre of mass elsewhere than the plant says",
     .separate_by = "hold the arm in postures that turn this link about its axis: a mass off its "
                    "place changes the sign of its effort, a wrong mass does not"},
    {.id = "payload",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kLoaded | Probe::kWeighed,
     .own_sentence = "a weight hangs on the tool that the plant does not have",
     .look_alikes_on_one_joint = kAsLink,
     .separate_by = "the same motion with the tool taken off, or with a known weight added",
     .on_tool = true},
    {.id = "link_length",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kLoaded | Probe::kSpeeds,
     .own_sentence =
         "the link from the joint that carries this one is longer or shorter than the plant's",
     .separate_by = kMeasureTheLink},
    {.id = "link_axial",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kLoaded | Probe::kSpeeds,
     .own_sentence = "the joint stands to the side, along the axis of the joint that carries it",
     .separate_by = kMeasureTheLink},
    {.id = "link_across",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kLoaded | Probe::kSpeeds,
     .own_sentence =
         "the joint stands off the line of its link, across the axis of the joint that carries it",
     .separate_by = kMeasureTheLink},
    {.id = "joint_zero",
     .stage = kDrive,
     .origin = Origin::kArmLoad,
     .probes = Probe::kLoaded | Probe::kWholeRange,
     .own_sentence = "the joint reads zero elsewhere than the plant says",
     .separate_by = "hold the joint where a spirit level or a stop says its angle, and compare the "
                    "reading"},
    {.id = "flexible_mode",
     .stage = kDrive,
     .probes = Probe::kPulses,
     .own_sentence = "the joint swings behind its drive",
     .separate_by = "steps of the desired position at 500 Hz or more: a mode rings at one "
                    "frequency, inertia does not ring"},
    {.id = "delay",
     .stage = kTransmission,
     .origin = Origin::kClock,
     .abscissa = Abscissa::kSpeed,
     .probes = Probe::kSpeeds,
     .separate_by = "repeat the motion at half and at double speed: a delay's error follows the "
                    "speed, hysteresis keeps its loop"},
    {.id = "lost_counts",
     .stage = kTransmission,
     .abscissa = Abscissa::kTime,
     .probes = Probe::kHomings,
     .own_sentence = "the encoder loses counts",
     .look_alikes = kAsSlip,
     .separate_by = kRecordTheJump},
    {.id = "quantisation",
     .stage = kTransmission,
     .own_sentence = "the encoder resolves less than the plant's",
     .separate_by = "pass a few degrees very slowly: the error repeats with every count"},
    {.id = "thermal_drift",
     .stage = kTransmission,
     .abscissa = Abscissa::kTime,
     .probes = Probe::kWarm,
     .separate_by =
         "record again after an hour of motion: drift has ended then, creep and slip have not"},
    {.id = "input_disturbance",
     .stage = kCommand,
     .abscissa = Abscissa::kTime,
     .probes = Probe::kPulses,
     .own_sentence = "pulses reach the drive that the controller did not send",
     .separate_by =
         "record the command that leaves the controller and the one that reaches the drive"},
    {.id = kUnknown,
     .stage = kDrive,
     .origin = Origin::kUnnamed,
     .own_sentence = "the mismatch is real, and no effect of the vocabulary explains it",
     .separate_by = "repeat the same motion twice: what does not repeat is noise"},
}};

}  // namespace

std::string_view EffectWords::sentence() const {
  if (!own_sentence.empty()) return own_sentence;
  const physics::EffectSpec* spec = physics::find_effect_spec(id);
  return spec != nullptr ? spec->sentence : std::string_view{};
}

std::span<const EffectWords> vocabulary_words() { return kVocabulary; }

const EffectWords& words_for(std::string_view id) {
  const auto* found = std::find_if(kVocabulary.begin(), kVocabulary.end(),
                                   [id](const EffectWords& words) { return words.id == id; });
  return found == kVocabulary.end() ? kVocabulary.back() : *found;
}

}  // namespace ravencal::diagnose
