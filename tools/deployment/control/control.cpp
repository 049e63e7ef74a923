// SPDX-License-Identifier: Apache-2.0
#include "control/control.hpp"

#include <fmt/format.h>
#include <sys/shm.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "core/run_level.hpp"
#include "monitor/telemetry_reader.hpp"

namespace ravencal::control {
namespace {

using monitor::TelemetryReader;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPollPeriod{5};
constexpr unsigned kPermissions = 0777;
constexpr unsigned kOwnerAlone = 0600;
constexpr std::size_t kWords = sizeof(ravencal_request) / sizeof(std::uint64_t);

core::Error io_error(const std::string& name, std::string_view what) {
  return {core::ErrorCode::kIo, fmt::format("{}: {}", name, what)};
}

bool is_own_file(const std::string& name) {
  struct stat status {};
  return ::stat(("/dev/shm" + name).c_str(), &status) == 0 && status.st_uid == ::geteuid();
}

/// The plugin's memory for requests.
class Memory {
 public:
  static core::Result<Memory> attach(const std::string& name, int id) {
    shmid_ds status{};
    if (::shmctl(id, IPC_STAT, &status) != 0) {
      return io_error(name, fmt::format("its memory for requests cannot be looked at: {}; only the "
                                        "user of the control process may ask it for something",
                                        std::strerror(errno)));
    }
    if (status.shm_perm.uid != ::geteuid() ||
        (status.shm_perm.mode & kPermissions) != kOwnerAlone ||
        status.shm_segsz < sizeof(ravencal_request)) {
      return io_error(name, "its memory for requests is not this user's alone");
    }
    void* const memory = ::shmat(id, nullptr, 0);
    if (memory == reinterpret_cast<void*>(-1)) {
      return io_error(name, fmt::format("its memory for requests cannot be attached: {}",
                                        std::strerror(errno)));
    }
    return Memory(static_cast<std::uint64_t*>(memory));
  }
  Memory(Memory&& other) noexcept : words_(std::exchange(other.words_, nullptr)) {}
  Memory& operator=(Memory&&) = delete;
  ~Memory() {
    if (words_ != nullptr) ::shmdt(words_);
  }

  [[nodiscard]] std::uint64_t number() const { return word(0).load(std::memory_order_acquire); }
  /// A whole request lies here that is newer than the one taken last.
  [[nodiscard]] bool holds_waiting(std::uint64_t taken) const {
    std::array<std::uint64_t, kWords> words{};
    for (std::size_t i = 0; i < kWords; ++i) words[i] = word(i).load(std::memory_order_acquire);
    return static_cast<std::int64_t>(words[0] - taken) > 0 &&
           words[3] == RAVENCAL_REQUEST_CHECK(words[0], words[1], words[2]);
  }

  /// The number last: the plugin does not look before it has changed.
  void write(const ravencal_request& request) {
    const auto words = std::bit_cast<std::array<std::uint64_t, kWords>>(request);
    for (std::size_t i = 1; i < kWords; ++i) word(i).store(words[i], std::memory_order_release);
    word(0).store(words[0], std::memory_order_release);
  }

 private:
  explicit Memory(std::uint64_t* words) : words_(words) {}
  [[nodiscard]] std::atomic_ref<std::uint64_t> word(std::size_t i) const {
    return std::atomic_ref<std::uint64_t>(words_[i]);
  }

  std::uint64_t* words_;
};

/// Newer than what was taken, whatever the clock does; and another one than what lies there.
std::uint64_t next_number(std::uint64_t taken, std::uint64_t there) {
  const auto now_ns =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                     std::chrono::system_clock::now().time_since_epoch())
                                     .count());
  const bool is_newer = static_cast<std::int64_t>(now_ns - taken) > 0;
  std::uint64_t number = is_newer ? now_ns : taken + 1;
  if (number == there) ++number;
  return number;
}

ravencal_request made(const Request& request, std::uint64_t number) {
  ravencal_request result{number,        RAVENCAL_REQUEST_VERSION, request.kind,
                          request.share, request.joints,           0};
  const auto words = std::bit_cast<std::array<std::uint64_t, kWords>>(result);
  result.check = RAVENCAL_REQUEST_CHECK(words[0], words[1], words[2]);
  return result;
}

bool is_taken_at_once(const Request& request) {
  return request.kind == RAVENCAL_REQUEST_OFF || request.kind == RAVENCAL_REQUEST_RESET;
}

bool waits_for_pedal(const Request& request, TelemetryReader& reader) {
  std::vector<monitor::NumberedTick> ticks;
  reader.read(ticks);
  return !is_taken_at_once(request) && !ticks.empty() &&
         ticks.back().tick.runlevel == core::kPedalDown;
}

}  // namespace

core::Result<Answer> ask(const std::string& name, const Request& request, double wait_s,
                         const std::function<bool()>& keep_going) {
  RAVENCAL_ASSIGN_OR_RETURN(TelemetryReader reader, TelemetryReader::open(name));
  if (!is_own_file(name)) return io_error(name, "is the telemetry of another user");
  RAVENCAL_ASSIGN_OR_RETURN(Memory memory, Memory::attach(name, reader.request_id()));
  // There is room for one: "off" and "reset" end what waits, all else would lose it.
  if (!is_taken_at_once(request) && memory.holds_waiting(reader.request_taken())) {
    return Answer::kOtherWaits;
  }
  const std::uint64_t number = next_number(reader.request_taken(), memory.number());
  memory.write(made(request, number));
  const auto begun = Clock::now();
  Answer answer = Answer::kNotTaken;
  while (reader.request_taken() != number) {
    if (reader.writer() != monitor::Writer::kAlive) {
      return io_error(name, "the control process has ended; it took nothing");
    }
    if (waits_for_pedal(request, reader)) answer = Answer::kWaitsForPedal;
    const double waited_s = std::chrono::duration<double>(Clock::now() - begun).count();
    if (waited_s >= wait_s || !keep_going()) return answer;
    std::this_thread::sleep_for(kPollPeriod);
  }
  return Answer::kTaken;
}

std::vector<std::string> own_names() {
  std::vector<std::string> names = monitor::telemetry_names();
  std::erase_if(names, [](const std::string& name) { return !is_own_file(name); });
  return names;
}

}  // namespace ravencal::control
