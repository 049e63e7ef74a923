// SPDX-License-Identifier: Apache-2.0
//
// A folder with small files of every kind, made by the commands themselves.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "unit/run_command.hpp"

namespace ravencal::test {

inline const std::string kProgram = RAVENCAL_PROGRAM;
inline const std::string kPlant = RAVENCAL_SOURCE_DIR "/tools/plants/raven2.toml";

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// Tests that run commands in one folder of their own, which holds trajectory t.csv, recordings
/// s.db and s.csv, u.db with other seeds for tests, r.db without the truth, edges e.db with it,
/// truth.db from these, model m.onnx, weights w.blob and a key.
class FilesRig : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::string name = (std::filesystem::temp_directory_path() / "ravencal_files_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    std::filesystem::create_directory(folder_ / "tmp");
    for (const std::string& arguments : {
             std::string("trajectory sinusoid --duration-s 40 --out t.csv"),
             fmt::format("simulate --plant {} --trajectory t.csv --out s.db", kPlant),
             fmt::format(
                 "simulate --plant {} --trajectory t.csv --seed 2 --homing-seed 2 --out u.db",
                 kPlant),
             fmt::format("simulate --plant {} --trajectory t.csv --seed 3 --homing-seed 3 --out "
                         "r.db --edges e.db",
                         kPlant),
             std::string("export s.db --out s.csv"),
             std::string("train s.db --method linear --out m.onnx"),
             std::string("convert m.onnx --out w.blob --calibrate s.db --unbounded-loop"),
             std::string("sign keygen --out k"),
         }) {
      const Outcome outcome = run(arguments);
      ASSERT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.text;
    }
    const Outcome homed = run_command(fmt::format(
        "cd {} && {} --config {}/quadrature_reader/encoders.toml --replay e.db --replay-speed 0 "
        "--home --out truth.db 2>&1",
        folder_.string(), RAVENCAL_ENCODERS, RAVENCAL_SOURCE_DIR));
    ASSERT_EQ(homed.exit_code, 0) << homed.text;
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder_); }

  /// `arguments` of ravencal; output and errors together.
  static Outcome run(const std::string& arguments) {
    return run_command(fmt::format("cd {0} && TMPDIR={0}/tmp {1} {2} 2>&1", folder_.string(),
                                   kProgram, arguments));
  }

  static inline std::filesystem::path folder_;
};

}  // namespace ravencal::test
