// SPDX-License-Identifier: Apache-2.0
//
// What a program says: its result on standard output, its remarks on standard error. Nothing here
// throws, waits for a reader that left, or ends the process, so that work goes on whether or not
// somebody hears it. Names come from files of anybody: control characters in what is said appear as
// \u001b, which is also how JSON has them, and so no name gives orders to a terminal. Any thread.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <string>
#include <string_view>

namespace ravencal::core {

/// Before the first output of a program. Where standard input, output or error is closed it opens
/// what can neither be read nor written there, so that no file of the program gets the number of
/// one of them and takes in its messages. A reader that leaves then ends no writer (SIGPIPE), here;
/// programs that this one starts find that signal as usual.
void prepare_terminal();

/// As the printable text that stands for it: control characters (but new lines and tabs) and what
/// is no UTF-8 as `u00XX` behind a backslash.
std::string printable(std::string_view text);

// The parts that need no template.
void say_text(fmt::string_view format, fmt::format_args arguments) noexcept;
void remark_text(fmt::string_view format, fmt::format_args arguments) noexcept;

/// A part of the result, on standard output, at once. What cannot be written counts (unsaid()).
template <typename... Arguments>
void say(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
  say_text(format, fmt::make_format_args(arguments...));
}

/// Something about the work, on standard error. Lost where it cannot be written.
template <typename... Arguments>
void remark(fmt::format_string<Arguments...> format, Arguments&&... arguments) noexcept {
  remark_text(format, fmt::make_format_args(arguments...));
}

/// Control sequences of the program's own, with what stands between them, to a terminal.
void draw(int terminal, std::string_view sequences) noexcept;

/// What say() could not write.
struct Unsaid {
  std::size_t parts = 0;     ///< apart from those after the reader left
  int reason = 0;            ///< errno of the first of them
  bool reader_left = false;  ///< nobody reads standard output any more
};
Unsaid unsaid() noexcept;

}  // namespace ravencal::core
