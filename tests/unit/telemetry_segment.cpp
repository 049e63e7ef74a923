// SPDX-License-Identifier: Apache-2.0
#include "unit/telemetry_segment.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>

namespace ravencal::test {
namespace {

/// Every 64-bit word that changes is stored whole, as a reader in another thread expects.
void store(void* to, const void* from, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, static_cast<const char*>(from) + i, sizeof word);
    __atomic_store_n(reinterpret_cast<std::uint64_t*>(static_cast<char*>(to) + i), word,
                     __ATOMIC_RELEASE);
  }
}

void require(bool condition) {
  if (!condition) std::abort();  // nothing after this could mean anything
}

}  // namespace

std::string telemetry_name(const std::string& ending) {
  struct Names {
    std::set<std::string> used;
    ~Names() {
      std::error_code ignored;
      for (const std::string& name : used) std::filesystem::remove("/dev/shm" + name, ignored);
    }
  };
  static Names names;
  const std::string name = "/ravencal_test_" + std::to_string(::getpid()) + "_" + ending;
  names.used.insert(name);
  return name;
}

ravencal_tick tick_number(std::uint64_t number) {
  ravencal_tick tick{};
  const auto small = static_cast<std::uint32_t>(number % 1'000'003);
  tick.tick = number;
  tick.t_ns = static_cast<std::int64_t>(number) * 1'000'000;
  for (std::uint32_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    tick.jpos_ji[j] = static_cast<float>(small + j);
    tick.correction_ji[j] = static_cast<float>(small) * 1e-6F;
    tick.predicted_ji[j] = -static_cast<float>(small + j);
    tick.enc_counts[j] = static_cast<std::int32_t>(small * (j + 1));
  }
  tick.confidence = static_cast<float>(small);
  tick.runlevel = 3;
  tick.state = RAVENCAL_STATE_ACTIVE;
  tick.doubts = small;
  tick.step_ns = small;
  return tick;
}

bool is_whole(const ravencal_tick& tick, std::uint64_t number) {
  const ravencal_tick wanted = tick_number(number);
  return std::memcmp(&tick, &wanted, sizeof tick) == 0;
}

TelemetrySegment::TelemetrySegment(const std::string& name, std::uint32_t slots)
    : path_("/dev/shm" + name), slots_(slots) {
  const std::size_t bytes =
      RAVENCAL_TELEMETRY_HEADER_BYTES + slots * sizeof(ravencal_telemetry_slot);
  const int id = ::shmget(IPC_PRIVATE, bytes, IPC_CREAT | 0640);
  memory_ = ::shmat(id, nullptr, 0);
  require(id >= 0 && memory_ != reinterpret_cast<void*>(-1));
  ::shmctl(id, IPC_RMID, nullptr);
  ravencal_telemetry_label& made = header().label;
  std::memcpy(made.magic, RAVENCAL_TELEMETRY_MAGIC, sizeof made.magic);
  made.version = RAVENCAL_TELEMETRY_VERSION;
  made.memory_id = id;
  made.header_bytes = RAVENCAL_TELEMETRY_HEADER_BYTES;
  made.slot_bytes = sizeof(ravencal_telemetry_slot);
  made.slot_count = slots;
  made.tick_ns = 1'000'000;
  made.writer_pid = 4711;
  made.start_realtime_ns = 1'600'000'000'000'000'000;
  std::strcpy(made.plugin_version, "9.8.7");
  ::unlink(path_.c_str());
  file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  require(file_ >= 0 && ::flock(file_, LOCK_EX | LOCK_NB) == 0);
  write_label();
}

TelemetrySegment::~TelemetrySegment() {
  ::shmdt(memory_);
  ::close(file_);
}

void TelemetrySegment::write_label() {
  const ravencal_telemetry_label& label = header().label;
  require(::pwrite(file_, &label, sizeof label, 0) == static_cast<ssize_t>(sizeof label));
}

ravencal_telemetry_slot& TelemetrySegment::slot(std::uint64_t number) {
  auto* const slots = reinterpret_cast<ravencal_telemetry_slot*>(static_cast<char*>(memory_) +
                                                                 RAVENCAL_TELEMETRY_HEADER_BYTES);
  return slots[number % slots_];
}

void TelemetrySegment::write(const ravencal_tick& tick) {
  const std::uint64_t number = header().written;
  const auto sequence = [&](std::uint64_t value) { store(&slot(number).sequence, &value, 8); };
  sequence(2 * number + 1);
  store(&slot(number).tick, &tick, sizeof tick);
  sequence(2 * number + 2);
  const std::uint64_t written = number + 1;
  store(&header().written, &written, sizeof written);
}

void TelemetrySegment::close_in_order() {
  const std::uint64_t one = 1;
  store(&header().closed, &one, sizeof one);
  ::unlink(path_.c_str());
  drop_lock();
}

void TelemetrySegment::drop_lock() { require(::flock(file_, LOCK_UN) == 0); }

}  // namespace ravencal::test
