// SPDX-License-Identifier: Apache-2.0
//
// What programs of the same user ask for in shared memory (ravencal/control.h). They may write
// anything at any time: one look per cycle, no wait. Real-time thread only.
#pragma once

#include <bit>
#include <cstdint>

#include "ravencal/control.h"
#include "rt_plugin/homing_constant.hpp"
#include "rt_plugin/operation.hpp"
#include "rt_plugin/telemetry_words.hpp"

namespace ravencal::rt {

class Requests {
 public:
  /// [init] Requests made up to then are ignored.
  void begin(std::int64_t start_realtime_ns) noexcept {
    taken_ = seen_ = static_cast<std::uint64_t>(start_realtime_ns);
  }

  /// Hands a new request to `operation` or `constant`. `memory`: null without one.
  void take(const std::uint64_t* memory, bool motors_follow, Operation& operation,
            HomingConstant& constant) noexcept {
    if (memory == nullptr) return;
    const std::uint64_t number = load_word(memory[0]);
    if (number == seen_) return;
    const auto request = load_record<ravencal_request>(memory);
    const auto words = std::bit_cast<Words<ravencal_request>>(request);
    // Being written: it is whole in one of the next cycles, or never.
    if (words[3] != RAVENCAL_REQUEST_CHECK(words[0], words[1], words[2])) return;
    ravencal_homing_constant asked_constant{};
    const bool is_constant = request.kind == RAVENCAL_REQUEST_HOMING_CONSTANT;
    if (is_constant && !read_constant(memory, request.number, asked_constant)) return;
    const bool is_known = request.version == RAVENCAL_REQUEST_VERSION &&
                          request.kind < RAVENCAL_REQUEST_KINDS && request.share >= 0.0F &&
                          request.share <= 1.0F && request.joints < 1U << RAVENCAL_JOINTS;
    const bool at_once =
        request.kind == RAVENCAL_REQUEST_OFF || request.kind == RAVENCAL_REQUEST_RESET;
    if (is_known && motors_follow && !at_once) return;
    seen_ = request.number;
    // Numbers may wrap: one that lies far ahead shuts nobody out.
    const bool is_newer = static_cast<std::int64_t>(request.number - taken_) > 0;
    if (!is_known || !is_newer) return;
    taken_ = request.number;
    if (request.kind == RAVENCAL_REQUEST_SHARE) {
      operation.set_share(request.share, request.joints);
    } else if (request.kind == RAVENCAL_REQUEST_RESET) {
      operation.reset();
    } else if (is_constant) {
      constant.ask(asked_constant);
    } else {
      operation.set_mode(static_cast<std::int32_t>(request.kind));
    }
  }

  /// Number of the request taken last.
  [[nodiscard]] std::uint64_t taken() const noexcept { return taken_; }

 private:
  static_assert(RAVENCAL_REQUEST_OFF == RAVENCAL_MODE_OFF &&
                RAVENCAL_REQUEST_ARM == RAVENCAL_MODE_ARM &&
                RAVENCAL_REQUEST_SHADOW == RAVENCAL_MODE_SHADOW);

  /// False: it is not whole, or of another request.
  static bool read_constant(const std::uint64_t* memory, std::uint64_t number,
                            ravencal_homing_constant& constant) noexcept {
    using Record = ravencal_constant_request;
    const auto record =
        load_record<Record>(memory + sizeof(ravencal_request) / sizeof(std::uint64_t));
    const auto words = std::bit_cast<Words<Record>>(record);
    constant = record.constant;
    return record.number == number &&
           words[5] == RAVENCAL_CONSTANT_CHECK(words[0], words[1], words[2], words[3], words[4]);
  }

  std::uint64_t taken_ = 0;
  std::uint64_t seen_ = 0;
};

}  // namespace ravencal::rt
