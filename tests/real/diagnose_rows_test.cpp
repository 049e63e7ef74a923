// SPDX-License-Identifier: Apache-2.0
//
// README's rows of `ravencal diagnose` on real recordings, made with the shipped program, plants
// and profiles. How good the figures are is asked in diagnose_real_test and improved_real_test.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace {

namespace fs = std::filesystem;

const fs::path kData = RAVENCAL_DATA_DIR;

class DiagnoseRows : public ::testing::TestWithParam<const char*> {};

TEST_P(DiagnoseRows, OneCommandMakesTheRow) {
  const std::string set = GetParam();
  if (!fs::exists(kData / set.substr(0, set.find("_friction")))) {
    GTEST_SKIP() << "no recordings of " << set << " at " << kData << " (RAVENCAL_DATA_DIR)";
  }
  const fs::path out = fs::path(::testing::TempDir()) / ("diagnose_rows_" + set);
  fs::remove_all(out);
  const std::string command =
      fmt::format("bash '{}/tests/real/diagnose_rows.sh' '{}' '{}' '{}' {}", RAVENCAL_SOURCE_DIR,
                  RAVENCAL_PROGRAM, kData.string(), out.string(), set);
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream stream(out / set / "report.json");
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  ASSERT_TRUE(report.contains("held_out")) << out;
  EXPECT_FALSE(report["effects"].empty());
  const auto& first = report["held_out"].at(0);
  EXPECT_LT(first["after"].get<double>(), 0.75 * first["before"].get<double>()) << first;
}

INSTANTIATE_TEST_SUITE_P(Real, DiagnoseRows,
                         ::testing::Values("emps", "bam_xl330", "raven2_uiuc", "raven2_uw",
                                           "dvrk_berkeley", "dvrk_jhu_tracker",
                                           "davinci_tool4_friction"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
