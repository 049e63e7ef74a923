// SPDX-License-Identifier: Apache-2.0
#include "diagnose/findings/sides.hpp"

namespace ravencal::diagnose {
namespace {

constexpr std::string_view kUndecided = "undecided";

constexpr std::string_view kRecordTheJoint =
    "record the joint by an encoder of its own: friction behind the cable stretches it, friction "
    "of "
    "the drive does not";
constexpr std::string_view kHoldTheOutput =
    "hold the gearbox's output and turn the motor to and fro: what yields then is in the gearbox";
constexpr std::string_view kUncouple =
    "take the cable off the gearbox's output, and then the gearbox off the motor, and record the "
    "same motion: what stays is on the motor's side";

void add(std::string& text, std::string_view sentence) {
  if (!text.empty()) text += "; ";
  text += sentence;
}

}  // namespace

std::optional<Sides> sides_of(const EffectWords& words, const Sensing& sensing) {
  if (words.seat == Seat::kNone) return std::nullopt;
  const bool turns_with_motor = words.seat == Seat::kDrive;
  Sides out{std::string(kUndecided), std::string(sensing.geared ? kUndecided : "none"), {}};
  // What two encoders see differently is between them, and friction that stretches no cable which
  // could be stretched is in front of it.
  if (sensing.joint_seen && (!turns_with_motor || sensing.yields))
    out.encoder = turns_with_motor ? "motor" : "joint";
  else
    add(out.decided_by, kRecordTheJoint);
  if (sensing.geared) add(out.decided_by, turns_with_motor ? kUncouple : kHoldTheOutput);
  return out;
}

}  // namespace ravencal::diagnose
