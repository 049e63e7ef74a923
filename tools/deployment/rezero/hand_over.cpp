// SPDX-License-Identifier: Apache-2.0
#include "rezero/hand_over.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <thread>

#include "control/control.hpp"
#include "monitor/telemetry_reader.hpp"

namespace ravencal::rezero {
namespace {

using Clock = std::chrono::steady_clock;
using Words = std::array<std::uint64_t, sizeof(ravencal_homing_constant) / sizeof(std::uint64_t)>;

constexpr std::chrono::milliseconds kInForcePeriod{5};

bool are_equal(const ravencal_homing_constant& a, const ravencal_homing_constant& b) {
  return std::bit_cast<Words>(a) == std::bit_cast<Words>(b);
}

/// Why the plugin took the request, but not the constant.
std::string refusal_of(const ravencal_telemetry_homing& homing,
                       const ravencal_homing_constant& constant) {
  if (homing.is_homed == 0) return "the robot is not homed; the constant belongs to a homing";
  if (homing.weights_checksum != constant.weights_checksum)
    return fmt::format(
        "the plugin runs other weights (checksum {:08x}) than the constant's ({:08x})",
        homing.weights_checksum, constant.weights_checksum);
  const bool is_same_homing =
      std::equal(std::begin(homing.enc_offset_counts), std::end(homing.enc_offset_counts),
                 std::begin(constant.enc_offset_counts));
  if (!is_same_homing) {
    return "the robot was homed again since (its encoder offsets are others); take a pose of this "
           "homing";
  }
  return "the constant is beyond the largest correction of the plugin, or the robot stopped";
}

}  // namespace

core::Result<HandedOver> hand_over(const std::string& name,
                                   const ravencal_homing_constant& constant, double wait_s,
                                   const std::function<bool()>& keep_going) {
  control::Request request;
  request.kind = RAVENCAL_REQUEST_HOMING_CONSTANT;
  request.constant = constant;
  RAVENCAL_ASSIGN_OR_RETURN(const control::Answer answer,
                            control::ask(name, request, wait_s, keep_going));
  if (answer != control::Answer::kTaken) {
    return HandedOver{answer == control::Answer::kWaitsForPedal,
                      control::sentence_of(answer, wait_s)};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const monitor::TelemetryReader reader,
                            monitor::TelemetryReader::open(name));
  const auto begun = Clock::now();
  const bool ends = constant.weights_checksum == 0;
  for (;;) {
    const ravencal_telemetry_homing homing = reader.homing();
    if (ends && homing.constant.weights_checksum == 0) {
      return HandedOver{true, "the constant is taken away"};
    }
    if (are_equal(homing.constant, constant)) {
      return HandedOver{true, "taken; it goes with the next homing"};
    }
    const std::chrono::duration<double> waited = Clock::now() - begun;
    if (waited.count() > wait_s || !keep_going()) {
      return HandedOver{false, "not in force: " + refusal_of(homing, constant)};
    }
    std::this_thread::sleep_for(kInForcePeriod);
  }
}

}  // namespace ravencal::rezero
