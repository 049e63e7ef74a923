// SPDX-License-Identifier: Apache-2.0
//
// Ten fixed cases of laws and generators that are not the project's: a guard against regressions.
// They were looked at, so what they count is no score.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "unit/run_command.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;
using Json = nlohmann::json;

const fs::path kWorlds = RAVENCAL_WORLDS_DIR;
constexpr int kSeed = 5505;
constexpr const char* kCases[] = {"a001", "a004", "a005", "a006", "a009",
                                  "a012", "a013", "a016", "a017", "a018"};
/// Floors of the channel from which on an effect must be named.
constexpr double kClearSize = 3.0;

Json read(const fs::path& path) {
  std::ifstream stream(path);
  return Json::parse(stream, nullptr, false);
}

double floors_of(const Json& hidden) {
  double most = 0.0;
  for (const Json& made : hidden["made"]["hidden"])
    most = std::max({most, made["over_pos"].get<double>(), made["over_eff"].get<double>()});
  return most;
}

bool names(const Json& report, const std::string& id) {
  return std::any_of(report["effects"].begin(), report["effects"].end(), [&](const Json& effect) {
    const Json& same = effect["ambiguous_with"];
    return effect["id"] == id || std::find(same.begin(), same.end(), id) != same.end();
  });
}

TEST(IndependentWorlds, StaySilentWhereNothingIsHiddenAndNameWhatIsClear) {
  if (!fs::exists(kWorlds / "kit.py"))
    GTEST_SKIP() << "no independent cases in " << kWorlds << "; set RAVENCAL_WORLDS_DIR";
  const fs::path out = fs::path(::testing::TempDir()) / fmt::format("worlds_{}", ::getpid());
  const auto made = test::run_command(
      fmt::format("python3 '{}' run --ravencal '{}' --out '{}' --seed {} --b 0 --only {} 2>&1",
                  (kWorlds / "kit.py").string(), RAVENCAL_PROGRAM, out.string(), kSeed,
                  fmt::join(kCases, ",")));
  if (!fs::exists(out / "cases")) GTEST_SKIP() << "its generators were not built: " << made.text;
  int clean = 0, clear = 0, named = 0;
  std::string silent;
  for (const char* name : kCases) {
    const fs::path folder = out / "cases" / name;
    const Json hidden = read(folder / "hidden.json");
    const Json report = read(folder / "why" / "report.json");
    ASSERT_TRUE(report.contains("effects")) << folder << "\n" << made.text;
    if (hidden["kind"] == "clean") {
      ++clean;
      EXPECT_EQ(report["verdict"]["kind"], "nothing_left_out") << folder << report["verdict"];
    } else if (hidden["kind"] == "single" && floors_of(hidden) >= kClearSize) {
      ++clear;
      const std::string id = hidden["subjects"][0];
      named += names(report, id) ? 1 : 0;
      if (!names(report, id)) silent += fmt::format("{} {}; ", name, id);
    }
  }
  EXPECT_EQ(clean, 3);
  EXPECT_EQ(clear, 6);
  EXPECT_GE(named, clear - 1) << silent;
  fs::remove_all(out);
}

}  // namespace
