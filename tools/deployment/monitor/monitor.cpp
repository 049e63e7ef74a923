// SPDX-License-Identifier: Apache-2.0
#include "monitor/monitor.hpp"

#include <fmt/format.h>
#include <pwd.h>

#include <charconv>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "core/terminal.hpp"
#include "monitor/screen.hpp"
#include "monitor/stream.hpp"
#include "monitor/telemetry_follower.hpp"
#include "monitor/tick_recording.hpp"
#include "monitor/view.hpp"
#include "monitor/watch.hpp"

namespace ravencal::monitor {
namespace {

using Clock = std::chrono::steady_clock;

/// A hundredth of the ring's length, so that a reader that gets processor time misses nothing.
constexpr std::chrono::milliseconds kPollPeriod{20};
/// Line of draw()'s picture with the plugin's state.
constexpr std::size_t kStateLine = 2;
constexpr double kLogRateHz = 1.0;

core::Result<std::optional<std::uint32_t>> trusted_user(const std::string& word) {
  if (word.empty()) return std::optional<std::uint32_t>();
  if (const passwd* const known = ::getpwnam(word.c_str())) return std::optional(known->pw_uid);
  std::uint32_t number = 0;
  const char* const end = word.data() + word.size();
  const auto read = std::from_chars(word.data(), end, number);
  if (read.ec == std::errc() && read.ptr == end) return std::optional(number);
  return core::usage_error(fmt::format("--user {}: there is no such user", word));
}

core::Result<std::string> choose_name(const std::string& wanted,
                                      std::optional<std::uint32_t> user) {
  if (!wanted.empty()) return wanted;
  const std::vector<std::string> names = telemetry_names(user);
  if (names.size() == 1) return names[0];
  if (names.empty()) {
    return core::Error{core::ErrorCode::kIo,
                       "there is no telemetry on this machine; is a controller running with "
                       "telemetry_name in the plugin's configuration?"};
  }
  return core::Error{
      core::ErrorCode::kUsage,
      fmt::format("there are several: {}; choose with --name", fmt::join(names, ", "))};
}

/// Empty while the writer writes and ticks come.
std::string notice_of(const TelemetryFollower& follower, const Watch& watch) {
  const std::uint32_t pid = follower.reader().writer_pid();
  switch (follower.writer()) {
    case Writer::kEnded:
      return fmt::format("THE WRITER HAS ENDED (process {}); waiting for a new one", pid);
    case Writer::kGone:
      return fmt::format("THE WRITER IS GONE (process {} was killed or crashed); waiting", pid);
    case Writer::kAlive:
      break;
  }
  if (!watch.is_stalled()) return "";
  return fmt::format("STALLED: NO TICK FOR {:.1f} s; process {} still holds the telemetry",
                     watch.age_s(), pid);
}

const char* event_name(Change change) {
  switch (change) {
    case Change::kEnded:
      return "writer_ended";
    case Change::kGone:
      return "writer_gone";
    default:
      return "attached";
  }
}

/// One run, from the first poll to the last.
class Session {
 public:
  Session(const Options& options, TelemetryReader reader)
      : options_(options), follower_(std::move(reader)) {
    surroundings_.name = follower_.reader().name();
    surroundings_.ascii = is_ascii_terminal();
  }

  core::Status open() {
    if (!options_.recording.empty()) {
      RAVENCAL_ASSIGN_OR_RETURN(TickRecording made,
                                TickRecording::create(options_.recording, follower_.reader()));
      recording_.emplace(std::move(made));
    }
    if (options_.json) {
      core::say("{}", event_json("attached", follower_.reader()));
    } else if (is_terminal()) {
      screen_.emplace();
    }
    return {};
  }

  core::Status poll() {
    ticks_.clear();
    const Change change = follower_.poll(ticks_);
    for (const NumberedTick& tick : ticks_) {
      watch_.take(tick, follower_.reader().tick_ns());
      if (recording_) RAVENCAL_RETURN_IF_ERROR(recording_->append(tick));
    }
    watch_.end_poll(std::chrono::duration<double>(Clock::now().time_since_epoch()).count());
    if (const auto counters = follower_.reader().counters()) watch_.take(*counters);
    watch_.take(follower_.reader().homing().constant);
    if (change == Change::kNone) return {};
    if (change == Change::kAttached) watch_.begin_writer();
    if (recording_) RAVENCAL_RETURN_IF_ERROR(recording_->append(change, follower_.reader()));
    if (options_.json) {
      // The last tick before the end, and only then the end.
      if (change != Change::kAttached) core::say("{}", tick_json(watch_));
      core::say("{}", event_json(event_name(change), follower_.reader()));
    } else if (!screen_) {
      show();
    }
    return {};
  }

  void show() {
    const bool alive = follower_.writer() == Writer::kAlive;
    if (alive && !watch_.is_current()) return;
    if (options_.json) {
      if (alive) core::say("{}", tick_json(watch_));
      return;
    }
    surroundings_.notice = notice_of(follower_, watch_);
    if (recording_) {
      surroundings_.recording =
          fmt::format("{} rows in {}", recording_->rows(), options_.recording);
    }
    if (screen_) {
      screen_->draw(draw(watch_, follower_.reader(), surroundings_), kStateLine);
    } else {
      core::say("{}\n", draw_line(watch_, surroundings_));
    }
  }

  [[nodiscard]] double show_rate_hz() const {
    return options_.json || screen_ ? options_.rate_hz : kLogRateHz;
  }
  /// Nobody reads standard output any more, and nothing is recorded.
  [[nodiscard]] bool is_in_vain() const { return !recording_ && core::unsaid().reader_left; }

  core::Result<Outcome> finish() {
    screen_.reset();
    Outcome outcome{surroundings_.name, watch_.taken(), watch_.missed()};
    if (recording_) {
      RAVENCAL_RETURN_IF_ERROR(recording_->finish());
      outcome.rows = recording_->rows();
      outcome.not_stored = recording_->not_stored();
    }
    return outcome;
  }

 private:
  const Options& options_;
  TelemetryFollower follower_;
  std::optional<TickRecording> recording_;
  std::optional<Screen> screen_;
  Watch watch_;
  Surroundings surroundings_;
  std::vector<NumberedTick> ticks_;
};

}  // namespace

core::Result<Outcome> run(const Options& options, const std::function<bool()>& keep_going) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto user, trusted_user(options.user));
  RAVENCAL_ASSIGN_OR_RETURN(const std::string name, choose_name(options.name, user));
  RAVENCAL_ASSIGN_OR_RETURN(TelemetryReader reader, TelemetryReader::open(name, user));
  Session session(options, std::move(reader));
  RAVENCAL_RETURN_IF_ERROR(session.open());
  const auto start = Clock::now();
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  double next_show_s = 0.0;
  while (keep_going() && !session.is_in_vain() &&
         (options.duration_s <= 0.0 || elapsed_s() < options.duration_s)) {
    RAVENCAL_RETURN_IF_ERROR(session.poll());
    if (elapsed_s() >= next_show_s) {
      session.show();
      next_show_s = elapsed_s() + 1.0 / session.show_rate_hz();
    }
    std::this_thread::sleep_for(kPollPeriod);
  }
  RAVENCAL_RETURN_IF_ERROR(session.poll());
  return session.finish();
}

}  // namespace ravencal::monitor
