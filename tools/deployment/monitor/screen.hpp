// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace ravencal::monitor {

/// The terminal on standard output, in its second screen while this lives, so that what was there
/// before comes back. Each picture is one write over the last one: nothing is cleared in between,
/// so nothing flickers.
class Screen {
 public:
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Draws as many lines and columns as the terminal has now; line `emphasised` stands out.
  void draw(const std::vector<std::string>& lines, std::size_t emphasised);
};

/// Standard output is a terminal.
bool is_terminal();
/// The user's terminal does not show UTF-8.
bool is_ascii_terminal();

}  // namespace ravencal::monitor
