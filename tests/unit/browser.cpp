// SPDX-License-Identifier: Apache-2.0
#include "unit/browser.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace ravencal::test {

bool has_browser() { return std::system("command -v chromium >/dev/null 2>&1") == 0; }

Opened open_in_browser(const std::filesystem::path& page, const std::filesystem::path& folder,
                       int width_px) {
  const std::string command =
      "timeout 1800 chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
      "--disable-background-networking --disable-component-update --disable-sync "
      "--disable-dev-shm-usage --enable-logging=stderr --virtual-time-budget=60000 --window-size=" +
      std::to_string(width_px) + ",800 --user-data-dir='" + (folder / "profile").string() +
      "' --dump-dom 'file://" + page.string() + "' 2>'" + (folder / "console").string() + "'";
  Opened opened;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return opened;
  std::array<char, 65536> block{};
  for (std::size_t got = 0; (got = fread(block.data(), 1, block.size(), pipe)) > 0;) {
    opened.dom.append(block.data(), got);
  }
  opened.ok = pclose(pipe) == 0;
  std::ifstream log(folder / "console");
  for (std::string line; std::getline(log, line);) {
    if (line.find("CONSOLE") != std::string::npos) opened.console += line + "\n";
  }
  return opened;
}

}  // namespace ravencal::test
