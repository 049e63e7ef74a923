// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/telemetry.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/version.hpp"
#include "ravencal/telemetry.h"
#include "rt_plugin/telemetry_words.hpp"

namespace ravencal::rt {
namespace {

using Header = ravencal_telemetry_header;
using Slot = ravencal_telemetry_slot;

constexpr std::uint64_t kSlots = RAVENCAL_TELEMETRY_SLOTS;
constexpr std::size_t kSegmentBytes = RAVENCAL_TELEMETRY_HEADER_BYTES + kSlots * sizeof(Slot);
constexpr std::size_t kMagicBytes = sizeof RAVENCAL_TELEMETRY_MAGIC - 1;
static_assert(sizeof(Header) <= RAVENCAL_TELEMETRY_HEADER_BYTES);

constexpr std::size_t word_at(std::size_t byte) { return byte / sizeof(std::uint64_t); }

/// shm_open is open in this folder, but in libc only since glibc 2.34: a plugin that called it
/// would not load on older systems.
constexpr char kFolder[] = "/dev/shm";

/// "/" and at least one character that is no slash, of which the first is no dot; with its end.
bool is_name(const char (&name)[64]) noexcept {
  const std::size_t length = ::strnlen(name, sizeof name);
  return length >= 2 && length < sizeof name && name[0] == '/' && name[1] != '.' &&
         std::strchr(name + 1, '/') == nullptr;
}

/// Whether a segment of that name may be put there: nothing is, or what a dead writer left.
std::int32_t check_free(const char* path) noexcept {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) return errno == ENOENT ? RAVENCAL_SUCCESS : RAVENCAL_ERROR_BUSY;
  // Writers hold an exclusive lock, which ends with their process however that ends. Asking for a
  // shared one disturbs neither a writer nor a reader that asks at the same time.
  const bool live = ::flock(file, LOCK_SH | LOCK_NB) != 0;
  char magic[kMagicBytes] = {};
  const bool ours = ::read(file, magic, sizeof magic) == static_cast<ssize_t>(sizeof magic) &&
                    std::memcmp(magic, RAVENCAL_TELEMETRY_MAGIC, sizeof magic) == 0;
  ::close(file);
  return live || !ours ? RAVENCAL_ERROR_BUSY : RAVENCAL_SUCCESS;
}

/// Reserves and maps the file. Without fallocate a full /dev/shm would show as SIGBUS in a tick.
std::int32_t map(int file, std::uint64_t*& words) noexcept {
  if (::fallocate(file, 0, 0, static_cast<off_t>(kSegmentBytes)) != 0) {
    return errno == ENOSPC ? RAVENCAL_ERROR_MEMORY : RAVENCAL_ERROR_IO;
  }
  void* const memory =
      ::mmap(nullptr, kSegmentBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file, 0);
  if (memory == MAP_FAILED) return RAVENCAL_ERROR_MEMORY;
  // Populating maps the pages of a file for reading only; the first write to each would fault.
  std::memset(memory, 0, kSegmentBytes);
  ::mlock(memory, kSegmentBytes);
  words = static_cast<std::uint64_t*>(memory);
  return RAVENCAL_SUCCESS;
}

void write_constants(std::uint64_t* words, const ravencal_config& config) noexcept {
  Header header{};
  std::memcpy(header.magic, RAVENCAL_TELEMETRY_MAGIC, kMagicBytes);
  header.version = RAVENCAL_TELEMETRY_VERSION;
  header.header_bytes = RAVENCAL_TELEMETRY_HEADER_BYTES;
  header.slot_bytes = sizeof(Slot);
  header.slot_count = RAVENCAL_TELEMETRY_SLOTS;
  header.tick_ns = config.tick_ns;
  header.writer_pid = static_cast<std::uint32_t>(::getpid());
  timespec now{};
  (void)::clock_gettime(CLOCK_REALTIME, &now);
  header.start_realtime_ns = std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
  std::strncpy(header.plugin_version, core::kVersion, sizeof header.plugin_version - 1);
  header.counters.struct_size = sizeof header.counters;
  std::memcpy(words, &header, sizeof header);
}

}  // namespace

std::int32_t Telemetry::open(const ravencal_config& config) noexcept {
  if (config.telemetry_name[0] == '\0') return RAVENCAL_SUCCESS;
  if (!is_name(config.telemetry_name)) return RAVENCAL_ERROR_ARGUMENT;
  (void)std::snprintf(path_, sizeof path_, "%s%s", kFolder, config.telemetry_name);
  if (const std::int32_t code = check_free(path_); code != RAVENCAL_SUCCESS) return code;

  // Made under another name and renamed when it is whole, so that nobody sees a part of it.
  char partial[sizeof path_ + 16];
  (void)std::snprintf(partial, sizeof partial, "%s/.%s.%d", kFolder, config.telemetry_name + 1,
                      static_cast<int>(::getpid()));
  ::unlink(partial);
  file_ = ::open(partial, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file_ < 0) return errno == ENOSPC ? RAVENCAL_ERROR_MEMORY : RAVENCAL_ERROR_IO;
  std::int32_t code =
      ::flock(file_, LOCK_EX | LOCK_NB) == 0 ? map(file_, words_) : RAVENCAL_ERROR_IO;
  if (code == RAVENCAL_SUCCESS) {
    write_constants(words_, config);
    const bool named = ::fchmod(file_, 0640) == 0 && ::rename(partial, path_) == 0;
    if (!named) code = RAVENCAL_ERROR_IO;
  }
  if (code != RAVENCAL_SUCCESS) {
    ::unlink(partial);
    path_[0] = '\0';
    close();
  }
  return code;
}

void Telemetry::close() noexcept {
  if (words_ != nullptr) {
    store_word(words_[word_at(offsetof(Header, closed))], 1);
    ::munmap(words_, kSegmentBytes);
    words_ = nullptr;
    if (path_[0] != '\0') ::unlink(path_);
  }
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

void Telemetry::write(const ravencal_tick& tick, const ravencal_counters& counters) noexcept {
  if (words_ == nullptr) return;
  const std::size_t slot_byte =
      RAVENCAL_TELEMETRY_HEADER_BYTES + (written_ % kSlots) * sizeof(Slot);
  std::uint64_t* const slot = words_ + word_at(slot_byte);
  store_word(slot[0], 2 * written_ + 1);
  store_record(slot + word_at(offsetof(Slot, tick)), tick);
  store_word(slot[0], 2 * written_ + 2);
  ++written_;
  write_counters(counters);
  store_word(words_[word_at(offsetof(Header, written))], written_);
}

/// Of a kilobyte, only what a tick can have changed: what is counted, and the newest transition.
void Telemetry::write_counters(const ravencal_counters& counters) noexcept {
  std::uint64_t& sequence = words_[word_at(offsetof(Header, counters_sequence))];
  std::uint64_t* const to = words_ + word_at(offsetof(Header, counters));
  store_word(sequence, 2 * written_ - 1);
  const auto store = [&](std::size_t byte, std::uint64_t value) {
    store_word(to[word_at(byte)], value);
  };
  store(offsetof(ravencal_counters, ticks), counters.ticks);
  for (std::size_t i = 0; i < RAVENCAL_STATE_COUNT; ++i) {
    store(offsetof(ravencal_counters, ticks_in_state) + i * sizeof(std::uint64_t),
          counters.ticks_in_state[i]);
  }
  for (std::size_t i = 0; i < RAVENCAL_DOUBT_KINDS; ++i) {
    store(offsetof(ravencal_counters, ticks_in_doubt) + i * sizeof(std::uint64_t),
          counters.ticks_in_doubt[i]);
  }
  store(offsetof(ravencal_counters, clamped_inputs), counters.clamped_inputs);
  store(offsetof(ravencal_counters, limited_rate), counters.limited_rate);
  store(offsetof(ravencal_counters, swaps), counters.swaps);
  store(offsetof(ravencal_counters, rollbacks), counters.rollbacks);
  store(offsetof(ravencal_counters, overruns), counters.overruns);
  store(offsetof(ravencal_counters, longest_step_ns), counters.longest_step_ns);
  store(offsetof(ravencal_counters, transitions), counters.transitions);
  const std::size_t newest =
      (counters.transitions + RAVENCAL_TRANSITIONS_KEPT - 1) % RAVENCAL_TRANSITIONS_KEPT;
  store_record(to + word_at(offsetof(ravencal_counters, last_transitions) +
                            newest * sizeof(ravencal_transition)),
               counters.last_transitions[newest]);
  store_word(sequence, 2 * written_);
}

}  // namespace ravencal::rt
