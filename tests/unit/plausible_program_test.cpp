// SPDX-License-Identifier: Apache-2.0
//
// An encoder that is set up wrongly, from its lines to a model: every command says so.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "unit/record/scratch.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

/// The lines of the encoders of a run of the twin, read through a configuration with faults.
class WrongEncoder : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new record::testing::Scratch();
    run("{program} trajectory sinusoid --seed 31 --duration-s 40 --out t.csv");
    run("{program} simulate --plant {source}/tools/plants/raven2.toml --trajectory t.csv --seed 32 "
        "--homing-seed 33 --edges edges.db --out robot.db");
  }
  static void TearDownTestSuite() { delete folder_; }

  static Outcome run(std::string command) {
    for (const auto& [word, value] :
         {std::pair<std::string, std::string>{"{program}", RAVENCAL_PROGRAM},
          {"{encoders}", RAVENCAL_ENCODERS},
          {"{source}", RAVENCAL_SOURCE_DIR}}) {
      for (auto at = command.find(word); at != std::string::npos; at = command.find(word))
        command.replace(at, word.size(), value);
    }
    return run_command(fmt::format("cd {} && {} 2>&1", (*folder_ / "").string(), command));
  }

  /// The truth through the shipped configuration in which `from` is `to`, merged into merged.db.
  static Outcome merge_with(const std::string& from, const std::string& to,
                            const std::string& options = "") {
    std::ifstream shipped(RAVENCAL_SOURCE_DIR "/quadrature_reader/encoders.toml");
    std::string text{std::istreambuf_iterator<char>(shipped), {}};
    EXPECT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(*folder_ / "encoders.toml") << text;
    const Outcome read =
        run("rm -f truth.db; {encoders} --config encoders.toml --replay edges.db --replay-speed 0 "
            "--home --out truth.db");
    EXPECT_EQ(read.exit_code, 0) << read.text;
    return run("{program} merge robot.db truth.db --overwrite --out merged.db " + options);
  }

  static record::testing::Scratch* folder_;
};
record::testing::Scratch* WrongEncoder::folder_ = nullptr;

TEST_F(WrongEncoder, FourfoldCountsAreRefusedUnlessTheUserSaysThatTheyAreRight) {
  const std::string counts = "counts_per_rev = 80000";
  const Outcome merged = merge_with(counts, "counts_per_rev = 20000");
  EXPECT_EQ(merged.exit_code, 3);
  EXPECT_NE(merged.text.find("x4 decoding"), std::string::npos) << merged.text;
  const Outcome confirmed = merge_with(counts, "plausible = false\ncounts_per_rev = 20000");
  EXPECT_EQ(confirmed.exit_code, 0) << confirmed.text;
  EXPECT_NE(confirmed.text.find("x4 decoding"), std::string::npos) << confirmed.text;
  const Outcome described = run("{program} info merged.db");
  EXPECT_NE(described.text.find("x4 decoding"), std::string::npos) << described.text;
  const Outcome trained = run("{program} train merged.db --method linear --out model.onnx");
  EXPECT_EQ(trained.exit_code, 0) << trained.text;
  EXPECT_NE(run("{program} info model.onnx").text.find("x4 decoding"), std::string::npos);
}

TEST_F(WrongEncoder, AScaleAndAnotherHardStopAreWarnings) {
  const Outcome scaled = merge_with("counts_per_rev = 80000", "counts_per_rev = 72000");
  EXPECT_EQ(scaled.exit_code, 0) << scaled.text;
  EXPECT_NE(scaled.text.find("warning: robot.db: shoulder: the truth moves"), std::string::npos)
      << scaled.text;
  const Outcome stop = merge_with("stop = \"min\"", "stop = \"max\"");
  EXPECT_EQ(stop.exit_code, 0) << stop.text;
  EXPECT_NE(stop.text.find("shoulder: the truth lies"), std::string::npos) << stop.text;
}

TEST_F(WrongEncoder, ATurnedSignIsRefusedWithAGivenDelayToo) {
  const Outcome turned = merge_with("sign = -1", "sign = 1", "--delay-ms 0");
  EXPECT_EQ(turned.exit_code, 3);
  EXPECT_NE(turned.text.find("opposite directions"), std::string::npos) << turned.text;
}

TEST_F(WrongEncoder, ARightOneIsBelieved) {
  const Outcome merged = merge_with("sign = -1", "sign = -1");
  EXPECT_EQ(merged.exit_code, 0) << merged.text;
  EXPECT_EQ(merged.text.find("warning"), std::string::npos) << merged.text;
  const Outcome trained = run("{program} train merged.db --method linear --out right.onnx");
  EXPECT_EQ(trained.exit_code, 0) << trained.text;
  EXPECT_EQ(trained.text.find("implausible"), std::string::npos) << trained.text;
}

}  // namespace
}  // namespace ravencal::test
