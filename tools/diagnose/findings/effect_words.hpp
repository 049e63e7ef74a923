// SPDX-License-Identifier: Apache-2.0
//
// What is said of each effect of the vocabulary, whatever a recording shows: one row for each id.
// Its physics stands in shared/physics, its way into a model in vocabulary/.
#pragma once

#include <span>
#include <string_view>

namespace ravencal::diagnose {

/// What makes an effect. Effects of one origin stand together on the page.
enum class Origin {
  kItself,         ///< the effect is its own cause
  kArmLoad,        ///< other masses than the plant's, on the whole arm
  kDriveFriction,  ///< motor and gearbox of one joint
  kClock,          ///< a stream that is late, for all joints
  kUnnamed,        ///< the mismatch is real and has no name
};

/// The circumstance that an effect follows: the page draws it over this.
enum class Abscissa { kPosition, kSpeed, kLoad, kTime };

/// Where friction, play or elasticity sits between motor and joint.
enum class Seat {
  kNone,     ///< the effect is none of these
  kDrive,    ///< turns with the motor, as far as the gearbox and the cable are stiff
  kBetween,  ///< parts motor and joint
  kJoint,    ///< behind what yields between motor and joint
};

/// A recording that changes one circumstance. An effect answers to those that change its size, and
/// a recording to which one of two effects answers parts them (experiments.hpp has the menu).
enum class Probe : unsigned {
  kNone = 0,
  kLoaded = 1U << 0U,
  kSpeeds = 1U << 1U,
  kHolds = 1U << 2U,
  kReversals = 1U << 3U,
  kOneByOne = 1U << 4U,
  kHomings = 1U << 5U,
  kWarm = 1U << 6U,
  kPressed = 1U << 7U,
  kWholeRange = 1U << 8U,
  kPulses = 1U << 9U,
  kWeighed = 1U << 10U,
};
constexpr Probe operator|(Probe a, Probe b) {
  return static_cast<Probe>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
constexpr bool contains(Probe set, Probe one) {
  return (static_cast<unsigned>(set) & static_cast<unsigned>(one)) != 0U;
}

struct EffectWords {
  std::string_view id;
  std::string_view stage;  ///< in which the vocabulary has it: transmission, drive or command
  Origin origin = Origin::kItself;
  Abscissa abscissa = Abscissa::kPosition;
  Seat seat = Seat::kNone;
  Probe probes = Probe::kNone;
  /// Of an effect that no plant has; physics/effects/effect_spec.hpp has the others'.
  std::string_view own_sentence{};
  /// Ids that make the same shape in every recording, so that no likelihood parts them.
  std::span<const std::string_view> look_alikes{};
  /// Those that only another joint would part.
  std::span<const std::string_view> look_alikes_on_one_joint{};
  std::string_view separate_by{};  ///< the experiment that parts it from others
  bool on_tool = false;            ///< one for the arm, felt by every joint

  /// What it does, in plain words.
  [[nodiscard]] std::string_view sentence() const;
};

/// The vocabulary in its order, "unknown" last.
std::span<const EffectWords> vocabulary_words();
/// Those of an id of the vocabulary; of "unknown" for any other.
const EffectWords& words_for(std::string_view id);

}  // namespace ravencal::diagnose
