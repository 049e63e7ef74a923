// SPDX-License-Identifier: Apache-2.0
//
// A folder for files of other programs, which Python writes where it has their libraries.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "exchange/load.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {

/// Tests that read files of other programs, in one folder of their own.
class ExchangeRig : public ::testing::Test {
 protected:
  ExchangeRig() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~ExchangeRig() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  /// Runs a script of Python with numpy as np; false where the module is not installed.
  [[nodiscard]] bool python(const std::string& module, const std::string& script) const {
    const auto run = [&](const std::string& command) {
      return run_command(fmt::format("cd '{}' && {} 2>&1", folder_.string(), command));
    };
    if (run("/usr/bin/python3 -c 'import numpy, " + module + "'").exit_code != 0) return false;
    write("script.py", "import numpy as np\n" + script);
    const Outcome outcome = run("/usr/bin/python3 script.py");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    return true;
  }
  /// Arguments of ravencal; output and errors together.
  [[nodiscard]] Outcome ravencal(const std::string& arguments) const {
    return run_command(
        fmt::format("cd '{}' && '{}' {} 2>&1", folder_.string(), RAVENCAL_PROGRAM, arguments));
  }
  [[nodiscard]] core::Result<record::Recording> load(const std::string& name,
                                                     const std::string& profile) const {
    record::LoadOptions options;
    options.profile = write("p.toml", profile).string();
    return exchange::load_recording(folder_ / name, options);
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / fmt::format("ravencal_exchange_{}", ::getpid());
};

}  // namespace ravencal::test
