// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/telemetry.hpp"

#include <time.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <span>

#include "core/version.hpp"
#include "ravencal/control.h"
#include "ravencal/telemetry.h"
#include "rt_plugin/counter_words.hpp"

namespace ravencal::rt {
namespace {

using Label = ravencal_telemetry_label;
using Header = ravencal_telemetry_header;
using Slot = ravencal_telemetry_slot;

constexpr std::uint64_t kSlots = RAVENCAL_TELEMETRY_SLOTS;
constexpr std::size_t kSegmentBytes = RAVENCAL_TELEMETRY_HEADER_BYTES + kSlots * sizeof(Slot);
constexpr std::size_t kMagicBytes = sizeof RAVENCAL_TELEMETRY_MAGIC - 1;
static_assert(sizeof(Header) <= RAVENCAL_TELEMETRY_HEADER_BYTES);

constexpr std::size_t word_at(std::size_t byte) { return byte / sizeof(std::uint64_t); }

/// "/" and at least one character that is no slash, of which the first is no dot; with its end.
bool is_name(const char (&name)[64]) noexcept {
  const std::size_t length = ::strnlen(name, sizeof name);
  return length >= 2 && length < sizeof name && name[0] == '/' && name[1] != '.' &&
         std::strchr(name + 1, '/') == nullptr;
}

/// What never changes, for the file and for the start of the memory.
Label make_label(const ravencal_config& config, const NamedMemory& memory) noexcept {
  Label label{};
  std::memcpy(label.magic, RAVENCAL_TELEMETRY_MAGIC, kMagicBytes);
  label.version = RAVENCAL_TELEMETRY_VERSION;
  label.memory_id = memory.id();
  label.request_id = memory.request_id();
  label.header_bytes = RAVENCAL_TELEMETRY_HEADER_BYTES;
  label.slot_bytes = sizeof(Slot);
  label.slot_count = RAVENCAL_TELEMETRY_SLOTS;
  label.tick_ns = config.tick_ns;
  label.writer_pid = static_cast<std::uint32_t>(::getpid());
  timespec now{};
  (void)::clock_gettime(CLOCK_REALTIME, &now);
  label.start_realtime_ns = std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
  std::strncpy(label.plugin_version, core::kVersion, sizeof label.plugin_version - 1);
  return label;
}

}  // namespace

std::int32_t Telemetry::open(const ravencal_config& config) noexcept {
  if (config.telemetry_name[0] == '\0') return RAVENCAL_SUCCESS;
  if (!is_name(config.telemetry_name)) return RAVENCAL_ERROR_ARGUMENT;
  std::int32_t code =
      memory_.reserve(kSegmentBytes, sizeof(ravencal_request) + sizeof(ravencal_constant_request));
  if (code == RAVENCAL_SUCCESS) {
    Header header{};
    header.label = make_label(config, memory_);
    start_realtime_ns_ = header.label.start_realtime_ns;
    header.counters.struct_size = sizeof header.counters;
    std::memcpy(memory_.words(), &header, sizeof header);
    const auto label = std::as_bytes(std::span(&header.label, 1));
    code = memory_.publish(config.telemetry_name, label, label.first(kMagicBytes));
  }
  if (code != RAVENCAL_SUCCESS) memory_.release();
  // Anybody may take a name in that folder, and so keep nobody's joints from being corrected.
  const bool goes_on =
      code == RAVENCAL_ERROR_BUSY && NamedMemory::is_strangers(config.telemetry_name);
  return goes_on ? RAVENCAL_SUCCESS : code;
}

void Telemetry::close() noexcept {
  std::uint64_t* const words = memory_.words();
  if (words != nullptr) store_word(words[word_at(offsetof(Header, closed))], 1);
  memory_.release();
}

void Telemetry::write(const ravencal_tick& tick, const JointVector& offset_ji,
                      const ravencal_counters& counters, std::uint64_t request_taken,
                      const ravencal_telemetry_homing& homing) noexcept {
  std::uint64_t* const words = memory_.words();
  if (words == nullptr) return;
  const std::size_t slot_byte =
      RAVENCAL_TELEMETRY_HEADER_BYTES + (written_ % kSlots) * sizeof(Slot);
  std::uint64_t* const slot = words + word_at(slot_byte);
  store_word(slot[0], 2 * written_ + 1);
  store_record(slot + word_at(offsetof(Slot, tick)), tick);
  const std::array<float, 4> offset = {offset_ji[0], offset_ji[1], offset_ji[2], 0.0F};
  store_record(slot + word_at(offsetof(Slot, offset_ji)), offset);
  store_word(slot[0], 2 * written_ + 2);
  ++written_;
  std::uint64_t& sequence = words[word_at(offsetof(Header, counters_sequence))];
  store_word(sequence, 2 * written_ - 1);
  store_counted(words + word_at(offsetof(Header, counters)), counters);
  store_record(words + word_at(offsetof(Header, homing)), homing);
  store_word(sequence, 2 * written_);
  store_word(words[word_at(offsetof(Header, request_taken))], request_taken);
  store_word(words[word_at(offsetof(Header, written))], written_);
}

}  // namespace ravencal::rt
