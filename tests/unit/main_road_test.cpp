// SPDX-License-Identifier: Apache-2.0
//
// From a trajectory to the plugin, with defaults, as users type it: nothing is refused at the end,
// and commands that state the same agree.
#include <cmath>
#include <nlohmann/json.hpp>

#include "unit/files_rig.hpp"

namespace ravencal::test {
namespace {
namespace fs = std::filesystem;

class MainRoad : public FilesRig {
 protected:
  static Outcome expect_ok(const std::string& arguments) {
    Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.text;
    return outcome;
  }

  static nlohmann::json json_in(const std::string& file) {
    return nlohmann::json::parse(bytes_of(folder_ / file), nullptr, false);
  }

  static std::string plugin() { return RAVENCAL_PLUGIN_PATH; }
};

// The seeds are those of the first trials in which default models were refused.
TEST_F(MainRoad, ThePluginTakesWhatDefaultTrainingAndConversionMake) {
  for (const int seed : {1, 2, 4}) {
    expect_ok(
        fmt::format("trajectory sinusoid --duration-s 60 --seed {} --out y.csv --force", seed));
    expect_ok(fmt::format("simulate --plant {} --trajectory y.csv --seed {} --out y.db --force",
                          kPlant, seed));
    expect_ok("train y.db --out y.onnx --force");
    for (const std::string precision : {"f32", "bf16", "int8"}) {
      const Outcome converted = run(fmt::format(
          "convert y.onnx --out y.blob --precision {} --calibrate y.db --check y.db --force",
          precision));
      // int8 makes some models worse than its users are promised.
      const bool is_too_coarse = converted.exit_code == 1 && precision == "int8" &&
                                 converted.text.find("above 2 %") != std::string::npos;
      if (is_too_coarse) continue;
      EXPECT_EQ(converted.exit_code, 0) << converted.text;
      EXPECT_NE(converted.text.find("self-test passed by the code for portable"), std::string::npos)
          << converted.text;
      expect_ok(fmt::format(
          "host --plugin {} --weights y.blob --recording y.db --rate-hz 0 --ticks 3000", plugin()));
    }
  }
}

// Where users rehearse, as in the controller.
TEST_F(MainRoad, HostRefusesWeightsOfTheOtherArm) {
  std::string plant = bytes_of(kPlant);
  const std::string gold = "arm = \"gold\"";
  ASSERT_NE(plant.find(gold), std::string::npos);
  plant.replace(plant.find(gold), gold.size(), "arm = \"green\"");
  std::ofstream(folder_ / "green.toml") << plant;
  expect_ok("simulate --plant green.toml --trajectory t.csv --out green.db");
  for (const char* source : {"--plant green.toml", "--recording green.db"}) {
    const Outcome outcome =
        run(fmt::format("host --plugin {} --weights w.blob {} --ticks 10", plugin(), source));
    EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
    EXPECT_NE(outcome.text.find("was trained for the gold arm and would correct the green one"),
              std::string::npos)
        << outcome.text;
  }
}

TEST_F(MainRoad, TheTruthIsNeverOfferedAsAnInput) {
  for (const char* features : {"joint:elbow", "*", "*elbow*"}) {
    expect_ok(
        fmt::format("train s.db --method linear --features '{}' --force --out x.onnx", features));
    const Outcome info = expect_ok("info x.onnx --json");
    const auto model = nlohmann::json::parse(info.text, nullptr, false);
    ASSERT_FALSE(model["features"].empty()) << info.text;
    for (const auto& feature : model["features"]) {
      EXPECT_EQ(feature["feature"].get<std::string>().find("truth"), std::string::npos) << features;
    }
  }
  const Outcome named =
      run("train s.db --method linear --features truth_counts.elbow --out x.onnx");
  EXPECT_EQ(named.exit_code, 2) << named.text;
}

TEST_F(MainRoad, EvaluateAsAppliedShowsWhatTheHostShows) {
  expect_ok("trajectory sinusoid --duration-s 20 --seed 9 --out test.csv --force");
  expect_ok(fmt::format(
      "simulate --plant {} --trajectory test.csv --seed 9 --homing-seed 9 --out test.db --force",
      kPlant));
  const Outcome evaluated = expect_ok(
      fmt::format("evaluate m.onnx test.db --json evaluated.json --as-applied {}", plugin()));
  EXPECT_NE(evaluated.text.find("as the plugin applies it"), std::string::npos) << evaluated.text;
  const Outcome hosted = expect_ok(fmt::format(
      "host --plugin {} --weights w.blob --recording test.db --rate-hz 0 --json hosted.json",
      plugin()));
  const auto applied = json_in("evaluated.json")["as_applied"];
  const auto host = json_in("hosted.json");
  EXPECT_EQ(applied["joints"], host["joints"]);
  EXPECT_EQ(applied["limited_rate"], host["states"]["limited_rate"]);
  EXPECT_GT(host["states"]["limited_rate"], 0);
  for (const Outcome& outcome : {evaluated, hosted}) {
    EXPECT_NE(outcome.text.find(fmt::format("limited     {} corrections of a joint",
                                            host["states"]["limited_rate"].get<int>())),
              std::string::npos)
        << outcome.text;
  }
}

TEST_F(MainRoad, AnExportedCsvComesBackWithRolesMetadataAndEvents) {
  expect_ok("export s.db --out back.csv");
  const Outcome imported = expect_ok("import back.csv --profile generic --out back.db");
  EXPECT_EQ(imported.text.find("nothing can be trained"), std::string::npos) << imported.text;
  auto before = nlohmann::json::parse(expect_ok("info s.db --json").text, nullptr, false);
  auto after = nlohmann::json::parse(expect_ok("info back.db --json").text, nullptr, false);
  for (auto* info : {&before, &after}) info->erase("file");
  EXPECT_EQ(before, after);
  EXPECT_FALSE(before["events"].empty());
  expect_ok("train back.db --method linear --out back.onnx");
  expect_ok("train back.csv --method linear --out back2.onnx");

  // Without the profile roles are unknown, and the import says so.
  fs::remove(folder_ / "back.csv.toml");
  const Outcome bare = expect_ok("import back.csv --profile generic --overwrite --out bare.db");
  EXPECT_NE(bare.text.find("`export` writes one beside"), std::string::npos) << bare.text;
}

}  // namespace
}  // namespace ravencal::test
