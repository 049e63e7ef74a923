// SPDX-License-Identifier: Apache-2.0
#include "rezero/constant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/students_t.hpp"
#include "core/units.hpp"

namespace ravencal::rezero {
namespace {

/// A confidence below it says that the training knows no such pose: most of the prediction is then
/// the training's mean.
constexpr double kLeastConfidence = 0.5;

std::string shown(double value_si, const std::string& unit_si) {
  const core::DisplayUnit unit = core::display_unit(unit_si);
  return fmt::format("{:.4g} {}", value_si * unit.per_si, unit.name);
}

template <typename Item>
const Item* of_joint(std::span<const Item> items, const std::string& joint) {
  const auto found =
      std::find_if(items.begin(), items.end(), [&](const Item& one) { return one.joint == joint; });
  return found == items.end() ? nullptr : &*found;
}

double bound_of(const model::HomingConstants* seen, const JointValue* at_most) {
  const double spread = seen != nullptr ? core::one_more(seen->constants).half95 : 0.0;
  if (at_most == nullptr) return spread;
  return spread > 0.0 ? std::min(spread, at_most->value) : at_most->value;
}

bool fits(double pose, const JointConstant& joint) {
  return std::abs(pose - joint.reading - joint.predicted) <= joint.bound;
}

/// The turns, in halves, by which the pose is off where the rest could be a homing's.
std::optional<double> turns_off(const JointConstant& joint) {
  if (joint.unit != "rad") return std::nullopt;
  const double halves = std::round(joint.constant / std::numbers::pi);
  if (halves == 0.0 || !fits(joint.pose - halves * std::numbers::pi, joint)) return std::nullopt;
  return halves / 2.0;
}

/// Another joint whose reading this pose fits, as that one's pose fits this reading.
const JointConstant* exchanged_with(const JointConstant& joint,
                                    const std::vector<JointConstant>& joints) {
  for (const JointConstant& other : joints) {
    if (&other == &joint || other.unit != joint.unit || !fits(joint.pose, other)) continue;
    if (!other.is_known || fits(other.pose, joint)) return &other;
  }
  return nullptr;
}

/// Why it is too large, as far as the values tell.
std::string explained(const JointConstant& joint, const std::vector<JointConstant>& joints) {
  if (const auto turns = turns_off(joint)) {
    return fmt::format(
        "the pose is {:g} turn{} off what the robot reads; give it as the robot "
        "counts it",
        *turns, std::abs(*turns) == 1.0 ? "" : "s");
  }
  if (const JointConstant* const other = exchanged_with(joint, joints)) {
    return fmt::format("the pose fits what the robot reads of {}: are the joints exchanged?",
                       other->joint);
  }
  if (fits(-joint.pose, joint)) return "the pose fits with the other sign";
  return "look at pose and homing; home again, or record other homings and train on them too";
}

void refuse(const JointConstant& joint, const JointReading& reading,
            const std::vector<JointConstant>& joints, std::vector<std::string>& refusals) {
  const auto say = [&](const std::string& sentence) {
    refusals.push_back(fmt::format("{}: {}", joint.joint, sentence));
  };
  if (!std::isfinite(joint.constant)) return say("the reading or the prediction is no number");
  const double still = joint.unit == "rad" ? kStill_rad : kStill_m;
  if (reading.range > still) {
    say(fmt::format("the robot moved during the reading, by {}; it must stand within {}",
                    shown(reading.range, joint.unit), shown(still, joint.unit)));
  }
  if (!(joint.bound > 0.0)) {
    return say(
        "the weights do not say how far homings of the training lay apart (it saw fewer than "
        "two, or chose no method by itself); train on recordings of several homings without "
        "--method, convert again, or give the largest constant with --at-most");
  }
  if (std::abs(joint.constant) > joint.bound) {
    say(fmt::format("the constant of {} is beyond the {} that a homing leaves at most: {}",
                    shown(joint.constant, joint.unit), shown(joint.bound, joint.unit),
                    explained(joint, joints)));
  }
  // The bound is about two standard deviations of what a homing leaves.
  if (2.0 * joint.uncertainty >= joint.bound) {
    say(fmt::format(
        "the pose is uncertain by {}, no better than what a homing leaves (at most {}); "
        "measure it better",
        shown(joint.uncertainty, joint.unit), shown(joint.bound, joint.unit)));
  }
}

}  // namespace

Judgement judge(const Reading& reading, std::span<const KnownJoint> pose,
                std::span<const model::HomingConstants> seen, std::span<const JointValue> at_most) {
  Judgement judgement;
  judgement.refusals = reading.doubts;
  for (const JointReading& one : reading.joints) {
    JointConstant& joint = judgement.joints.emplace_back();
    joint.joint = one.joint;
    joint.unit = one.unit;
    joint.reading = one.reading;
    joint.predicted = one.predicted;
    const model::HomingConstants* const of_training = of_joint(seen, one.joint);
    joint.bound = bound_of(of_training, of_joint(at_most, one.joint));
    const KnownJoint* const known = of_joint(pose, one.joint);
    if (known == nullptr) continue;
    joint.is_known = true;
    joint.pose = known->value;
    joint.uncertainty = known->uncertainty;
    joint.constant = known->value - one.reading - one.predicted;
    joint.expected_rest =
        std::hypot(known->uncertainty, of_training != nullptr ? of_training->rmse_about_mean : 0.0);
  }
  if (reading.confidence < kLeastConfidence) {
    judgement.refusals.push_back(
        fmt::format("the weights know no such pose (confidence {:.2f}); choose one amid the motion "
                    "of the training",
                    reading.confidence));
  }
  for (std::size_t k = 0; k < judgement.joints.size(); ++k) {
    if (!judgement.joints[k].is_known) continue;
    refuse(judgement.joints[k], reading.joints[k], judgement.joints, judgement.refusals);
  }
  return judgement;
}

std::string table_of(const Judgement& judgement) {
  std::string text =
      fmt::format("{:<12}{:<5}{:>10}{:>10}{:>10}{:>10}{:>10}{:>11}{:>10}\n", "joint", "unit",
                  "reads", "weights", "pose", "+-", "constant", "at most", "error +-");
  for (const JointConstant& joint : judgement.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    const auto number = [&](double value_si, bool is_there) {
      return is_there ? fmt::format("{:.4f}", value_si * unit.per_si) : std::string("-");
    };
    text +=
        fmt::format("{:<12}{:<5}{:>10}{:>10}{:>10}{:>10}{:>10}{:>11}{:>10}\n", joint.joint,
                    unit.name, number(joint.reading, true), number(joint.predicted, true),
                    number(joint.pose, joint.is_known), number(joint.uncertainty, joint.is_known),
                    number(joint.constant, true), number(joint.bound, joint.bound > 0.0),
                    number(joint.expected_rest, joint.is_known));
  }
  return text;
}

}  // namespace ravencal::rezero
