// SPDX-License-Identifier: Apache-2.0
#include "control/control.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <thread>

#include "control/request_memory.hpp"
#include "core/run_level.hpp"
#include "monitor/telemetry_reader.hpp"

namespace ravencal::control {
namespace {

using monitor::TelemetryReader;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPollPeriod{5};
/// A loop without a tick for so long stands, as `ravencal monitor` has it.
constexpr double kStandsAfter_s = 1.0;

core::Error io_error(const std::string& name, std::string_view what) {
  return {core::ErrorCode::kIo, fmt::format("{}: {}", name, what)};
}

core::Error other_user(const std::string& name) {
  return io_error(name,
                  "is the telemetry of another user; only the user of the control process may ask "
                  "it for something");
}

bool is_file_of(const std::string& name, bool own) {
  struct stat status {};
  return ::stat(("/dev/shm" + name).c_str(), &status) == 0 && (status.st_uid == ::geteuid()) == own;
}

bool is_newer(std::uint64_t number, std::uint64_t than) {
  return static_cast<std::int64_t>(number - than) > 0;  // numbers may wrap
}

/// Newer than what was taken and than the plugin, whatever the clock does; and another one than
/// what lies there.
std::uint64_t next_number(const TelemetryReader& reader, std::uint64_t there) {
  const auto now_ns =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                     std::chrono::system_clock::now().time_since_epoch())
                                     .count());
  // Before its first tick the plugin shows no number; it has taken its own start.
  std::uint64_t taken = reader.request_taken();
  if (taken == 0) taken = static_cast<std::uint64_t>(reader.start_realtime_ns());
  std::uint64_t number = is_newer(now_ns, taken) ? now_ns : taken + 1;
  if (number == there) ++number;
  return number;
}

/// One request, from its writing to its answer.
class Asking {
 public:
  Asking(TelemetryReader& reader, RequestMemory& memory, const Request& request)
      : reader_(reader), memory_(memory), request_(request) {
    see_ticks();  // those before are no sign that the loop runs
    write();
    begun_ = last_tick_ = Clock::now();
    ticks_ = 0;
  }

  [[nodiscard]] bool is_taken() const { return reader_.request_taken() == written_.number; }
  [[nodiscard]] bool is_overtaken() const { return !memory_.holds(written_); }
  [[nodiscard]] double waited_s() const { return seconds_since(begun_); }

  void write() {
    written_ = {next_number(reader_, memory_.number()),
                RAVENCAL_REQUEST_VERSION,
                request_.kind,
                request_.share,
                request_.joints,
                0};
    memory_.write(written_, request_.constant);
  }

  void see_ticks() {
    std::vector<monitor::NumberedTick> ticks;
    reader_.read(ticks);
    if (ticks.empty()) return;
    ticks_ += ticks.size();
    last_tick_ = Clock::now();
    pedal_is_down_ = ticks.back().tick.runlevel == core::kPedalDown;
  }

  /// The answer where nobody took it until now.
  Answer give_up(bool is_interrupted) {
    const bool stands = ticks_ == 0 || seconds_since(last_tick_) > kStandsAfter_s;
    const bool waits = pedal_is_down_ && !stands && !is_interrupted && !at_once(request_);
    if (waits && request_.stays) return Answer::kWaitsForPedal;
    // Who is told that it was not taken must not see it taken later.
    memory_.withdraw(written_, reader_.request_taken());
    std::this_thread::sleep_for(2 * kPollPeriod);  // a step that has seen it comes to its end
    if (is_taken()) return Answer::kTaken;
    return stands ? Answer::kStands : Answer::kNotTaken;
  }

  static bool at_once(const Request& request) {
    return request.kind == RAVENCAL_REQUEST_OFF || request.kind == RAVENCAL_REQUEST_RESET;
  }

 private:
  static double seconds_since(Clock::time_point then) {
    return std::chrono::duration<double>(Clock::now() - then).count();
  }

  TelemetryReader& reader_;
  RequestMemory& memory_;
  const Request& request_;
  ravencal_request written_{};
  Clock::time_point begun_;
  Clock::time_point last_tick_;
  std::size_t ticks_ = 0;
  bool pedal_is_down_ = false;
};

}  // namespace

core::Result<Answer> ask(const std::string& name, const Request& request, double wait_s,
                         const std::function<bool()>& keep_going) {
  if (is_file_of(name, false)) return other_user(name);
  RAVENCAL_ASSIGN_OR_RETURN(TelemetryReader reader, TelemetryReader::open(name));
  if (reader.owner_uid() != ::geteuid()) return other_user(name);
  RAVENCAL_ASSIGN_OR_RETURN(RequestMemory memory, RequestMemory::attach(name, reader.request_id()));
  if (request.kind == RAVENCAL_REQUEST_HOMING_CONSTANT && !memory.has_room_for_constant()) {
    return io_error(name, "its plugin is older than 3.3 and knows no constant of a homing");
  }
  // There is room for one: "off" and "reset" end what waits, all else would lose it.
  const bool at_once = Asking::at_once(request);
  if (!at_once && memory.holds_waiting(reader.request_taken())) return Answer::kOtherWaits;
  Asking asking(reader, memory, request);
  while (!asking.is_taken()) {
    if (reader.writer() != monitor::Writer::kAlive) {
      return io_error(name, "the control process has ended; it took nothing");
    }
    asking.see_ticks();
    if (asking.is_overtaken() && !asking.is_taken()) {
      if (!at_once) return Answer::kOvertaken;
      asking.write();
    }
    const bool is_interrupted = !keep_going();
    if (asking.waited_s() >= wait_s || is_interrupted) return asking.give_up(is_interrupted);
    std::this_thread::sleep_for(kPollPeriod);
  }
  return Answer::kTaken;
}

std::string sentence_of(Answer answer, double wait_s) {
  switch (answer) {
    case Answer::kTaken:
      return "taken";
    case Answer::kWaitsForPedal:
      return "the pedal is down; it is taken when that is up";
    case Answer::kOtherWaits:
      return "not asked; an earlier request waits until the pedal is up";
    case Answer::kOvertaken:
      return "another program asked at the same time; look with ravencal monitor";
    case Answer::kNotTaken:
      return fmt::format("not taken within {:g} s, and withdrawn", wait_s);
    case Answer::kStands:
      break;
  }
  return "not taken, and withdrawn: the control loop stands";
}

std::vector<std::string> own_names() {
  std::vector<std::string> names = monitor::telemetry_names();
  std::erase_if(names, [](const std::string& name) { return !is_file_of(name, true); });
  return names;
}

}  // namespace ravencal::control
