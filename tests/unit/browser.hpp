// SPDX-License-Identifier: Apache-2.0
//
// Opens a page in headless Chromium, as a user would.
#pragma once

#include <filesystem>
#include <string>

namespace ravencal::test {

/// What the browser made of a page: its final elements and its console.
struct Opened {
  std::string dom;
  std::string console;
  bool ok = false;
};

/// False where no Chromium is installed.
bool has_browser();

/// `folder` keeps the browser's profile from one page to the next.
Opened open_in_browser(const std::filesystem::path& page, const std::filesystem::path& folder,
                       int width_px = 1280);

}  // namespace ravencal::test
