// SPDX-License-Identifier: Apache-2.0
#include "cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "core/terminal.hpp"

namespace ravencal::cli {
namespace {

constexpr std::chrono::seconds kSilence{2};
constexpr std::chrono::milliseconds kTerminalInterval{200};
constexpr std::chrono::seconds kLogInterval{10};

}  // namespace

Progress::Progress(std::string_view task)
    : task_(task), start_(Clock::now()), last_(start_), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_ && terminal_) core::draw(STDERR_FILENO, "\n");
}

void Progress::update(double done, std::string_view detail) {
  const auto now = Clock::now();
  const auto interval =
      terminal_ ? Clock::duration(kTerminalInterval) : Clock::duration(kLogInterval);
  const bool due = now - last_ >= interval || (done >= 1.0 && drawn_);
  if (now - start_ < kSilence || !due) return;
  last_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const double left_s = done > 0.0 ? elapsed_s * (1.0 - done) / done : 0.0;
  const std::string line =
      fmt::format("{} {:3.0f} %  {}  {:.0f} s left", task_, 100.0 * done, detail, left_s);
  if (terminal_) {
    core::draw(STDERR_FILENO, "\r\033[K");
    core::remark("{}", line);
  } else {
    core::remark("{}\n", line);
  }
  drawn_ = true;
}

}  // namespace ravencal::cli
