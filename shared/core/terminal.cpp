// SPDX-License-Identifier: Apache-2.0
#include "core/terminal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>

#include "core/utf8.hpp"
#include "core/write_all.hpp"

namespace ravencal::core {
namespace {

std::atomic<std::size_t> unsaid_parts{0};
std::atomic<int> unsaid_reason{0};
std::atomic<bool> reader_has_left{false};

/// 0, or errno.
int write_printable(int file, fmt::string_view format, fmt::format_args arguments) noexcept {
  try {
    return write_all(file, printable(fmt::vformat(format, arguments))) ? 0 : errno;
  } catch (...) {  // of missing memory
    return ENOMEM;
  }
}

}  // namespace

void prepare_terminal() {
  for (const int file : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(file, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number is this one. Using it is an error, as it is of one that is closed.
    (void)::open("/dev/null", file == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
  struct sigaction now = {};
  ::sigaction(SIGPIPE, nullptr, &now);
  if (now.sa_handler == SIG_IGN) return;
  // Unlike SIG_IGN, a handler does not outlive exec.
  struct sigaction nothing = {};
  nothing.sa_handler = [](int) {};
  nothing.sa_flags = SA_RESTART;
  sigemptyset(&nothing.sa_mask);
  ::sigaction(SIGPIPE, &nothing, nullptr);
}

std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const auto first = static_cast<unsigned char>(text[0]);
    unsigned code = first;
    if (length == 2) code = (first & 0x1fU) << 6U | (text[1] & 0x3fU);
    if (length == 3) code = (first & 0x0fU) << 12U | (text[1] & 0x3fU) << 6U | (text[2] & 0x3fU);
    const bool turns = length == 3 && ((code >= 0x202a && code <= 0x202e) ||  // of direction
                                       (code >= 0x2066 && code <= 0x2069));
    const bool controls = turns || (length <= 2 && (code < 0x20 || (code >= 0x7f && code < 0xa0)) &&
                                    code != '\n' && code != '\t');
    if (length == 0 || controls) {
      shown += fmt::format("\\u{:04x}", code);
    } else {
      shown += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return shown;
}

void say_text(fmt::string_view format, fmt::format_args arguments) noexcept {
  if (reader_has_left) return;
  const int reason = write_printable(STDOUT_FILENO, format, arguments);
  if (reason == 0) return;
  if (reason == EPIPE) {
    reader_has_left = true;
    return;
  }
  int none = 0;
  unsaid_reason.compare_exchange_strong(none, reason);
  ++unsaid_parts;
}

void remark_text(fmt::string_view format, fmt::format_args arguments) noexcept {
  (void)write_printable(STDERR_FILENO, format, arguments);
}

void draw(int terminal, std::string_view sequences) noexcept {
  (void)write_all(terminal, sequences);
}

Unsaid unsaid() noexcept { return {unsaid_parts, unsaid_reason, reader_has_left}; }

}  // namespace ravencal::core
