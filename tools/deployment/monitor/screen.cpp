// SPDX-License-Identifier: Apache-2.0
#include "monitor/screen.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "core/terminal.hpp"
#include "monitor/view.hpp"

namespace ravencal::monitor {
namespace {

// ECMA-48 control sequences; ?1049 (second screen) and ?25 (cursor) are xterm's.
constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l\x1b[2J";
constexpr std::string_view kLeave = "\x1b[?25h\x1b[?1049l";
constexpr std::string_view kHome = "\x1b[H";
constexpr std::string_view kClearRestOfLine = "\x1b[K";
constexpr std::string_view kClearBelow = "\x1b[J";
constexpr std::string_view kBold = "\x1b[1m";
constexpr std::string_view kPlain = "\x1b[0m";

void put(std::string_view bytes) { core::draw(STDOUT_FILENO, bytes); }

winsize terminal_size() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) {
    size.ws_row = 24;
    size.ws_col = 80;
  }
  return size;
}

}  // namespace

Screen::Screen() { put(kEnter); }
Screen::~Screen() { put(kLeave); }

void Screen::draw(const std::vector<std::string>& lines, std::size_t emphasised) {
  const winsize size = terminal_size();
  const std::size_t count = std::min<std::size_t>(lines.size(), size.ws_row);
  std::string picture(kHome);
  for (std::size_t i = 0; i < count; ++i) {
    if (i == emphasised) picture += kBold;
    picture += clip(core::printable(lines[i]), size.ws_col);
    if (i == emphasised) picture += kPlain;
    picture += kClearRestOfLine;
    if (i + 1 < count) picture += "\r\n";
  }
  picture += kClearBelow;
  put(picture);
}

bool is_terminal() { return ::isatty(STDOUT_FILENO) == 1; }

bool is_ascii_terminal() {
  for (const char* variable : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* const value = std::getenv(variable);
    if (value == nullptr || *value == '\0') continue;
    const std::string_view locale(value);
    return locale.find("UTF-8") == locale.npos && locale.find("utf8") == locale.npos;
  }
  return true;
}

}  // namespace ravencal::monitor
