// SPDX-License-Identifier: Apache-2.0
//
// What commands say where something does not fit, and what they print of perfect joints.
#include "unit/files_rig.hpp"

namespace ravencal::test {
namespace {
namespace fs = std::filesystem;

const std::string kEmps = RAVENCAL_SOURCE_DIR "/tools/plants/emps.toml";

class MainRoadWords : public FilesRig {
 protected:
  /// The command ends with that code and says each of the words.
  static void expect(int exit_code, const std::string& arguments,
                     const std::vector<std::string>& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << "\n" << outcome.text;
    for (const std::string& word : words) {
      EXPECT_NE(outcome.text.find(word), std::string::npos) << arguments << ": " << word << "\n"
                                                            << outcome.text;
    }
  }

  /// A recording of one joint: an estimate that moves and a truth `off` away from it.
  static void write_csv(const std::string& name, const std::string& truth_joint,
                        const std::string& estimate_joint, double off) {
    std::ofstream csv(folder_ / name);
    csv << "t_s";
    if (!truth_joint.empty()) csv << ",truth." << truth_joint << "_m";
    if (!estimate_joint.empty()) csv << ",estimate." << estimate_joint << "_m";
    csv << "\n";
    for (int row = 0; row < 400; ++row) {
      const double x = 0.1 * (row % 37) - 0.05 * (row % 11);
      csv << fmt::format("{:.2f}", 0.01 * row);
      if (!truth_joint.empty()) csv << fmt::format(",{}", x + off + (off == 0.0 ? 0.0 : 0.1 * x));
      if (!estimate_joint.empty()) csv << fmt::format(",{}", x);
      csv << "\n";
    }
  }
};

TEST_F(MainRoadWords, ATrajectoryOfOtherJointsSaysHowToMakeOne) {
  expect(3, "simulate --plant " + kEmps + " --trajectory t.csv --out x.db",
         {"t.csv: no column of 'carriage'", "shoulder, elbow, insertion",
          "ravencal trajectory zigzag --plant"});
}

TEST_F(MainRoadWords, JointsThatDifferAreListedSideBySide) {
  write_csv("named.csv", "lift", "Lift", 0.5);
  expect(3, "train named.csv --profile generic --out x.onnx",
         {"the truth of lift", "the estimate of Lift"});
  expect(3, "evaluate m.onnx r.db", {"truth of no joint", "shoulder, elbow, insertion"});
}

TEST_F(MainRoadWords, TruthAloneSaysWhatIsMissing) {
  write_csv("truth.csv", "lift", "", 0.5);
  expect(3, "train truth.csv --profile generic --out x.onnx",
         {"the truth of lift", "the estimate of no joint", "merge"});
}

TEST_F(MainRoadWords, AnExportWithoutTruthNamesMerge) {
  expect(3, "export r.db --profile raven2 --out edges.csv", {"truth.shoulder", "ravencal merge"});
}

TEST_F(MainRoadWords, AnExportReplacesNothingUnasked) {
  std::ofstream(folder_ / "kept.csv") << "mine\n";
  expect(2, "export s.db --out kept.csv", {"kept.csv", "--force"});
  EXPECT_EQ(bytes_of(folder_ / "kept.csv"), "mine\n");
  expect(0, "export s.db --out kept.csv --overwrite", {"rows"});
}

TEST_F(MainRoadWords, APlantThatIsNoTomlSaysSo) {
  expect(3, "simulate --plant s.db --trajectory t.csv --out x.db", {"a plant is TOML"});
}

TEST_F(MainRoadWords, EvaluationOnTrainingDataWarnsUnderAnyName) {
  fs::copy_file(folder_ / "s.db", folder_ / "copy.db", fs::copy_options::overwrite_existing);
  expect(0, "evaluate m.onnx copy.db --same-seed", {"copy.db: the model was trained on it"});
}

// What wanders on the twin is in both, whatever the motion is.
TEST_F(MainRoadWords, ARunSeedOfTheTrainingIsNoTest) {
  expect(0, "trajectory sinusoid --duration-s 20 --seed 8 --out other.csv", {});
  const std::string simulate = "simulate --plant " + kPlant + " --trajectory other.csv ";
  expect(0, simulate + "--homing-seed 8 --out leak.db", {});
  expect(0, simulate + "--seed 8 --homing-seed 8 --out honest.db", {});
  expect(0, simulate + "--seed 8 --out session.db", {});
  const std::vector<std::string> refusal = {"leak.db: has the run seed 1 of s.db", "--seed",
                                            "--same-seed"};
  expect(3, "evaluate m.onnx leak.db", refusal);
  expect(3, "train s.db --method linear --validate leak.db --out x.onnx", refusal);
  EXPECT_FALSE(fs::exists(folder_ / "x.onnx"));
  expect(3, "compare --train s.db --test leak.db --methods raw bias --out rivals", refusal);
  expect(3, "ablate removal --train s.db --test leak.db --plan --out study", refusal);

  expect(0, "evaluate m.onnx leak.db --same-seed --json leak.json", {"same seed: leak.db"});
  EXPECT_NE(bytes_of(folder_ / "leak.json").find("\"same_seed\""), std::string::npos);
  expect(0, "train s.db --method linear --validate leak.db --same-seed --out leaking.onnx",
         {"same seed: leak.db"});
  expect(
      0,
      "compare --train s.db --test leak.db --methods raw bias --no-curve --same-seed --out rivals",
      {"same seed: leak.db"});

  expect(0, "evaluate m.onnx session.db",
         {"one homing: session.db has the homing (seed 1) of s.db"});
  const Outcome honest = run("evaluate m.onnx honest.db --json honest.json");
  EXPECT_EQ(honest.exit_code, 0) << honest.text;
  EXPECT_EQ(honest.text.find("one homing:"), std::string::npos) << honest.text;
  EXPECT_EQ(bytes_of(folder_ / "honest.json").find("one_homing"), std::string::npos);
  EXPECT_EQ(bytes_of(folder_ / "honest.json").find("same_seed"), std::string::npos);
}

TEST_F(MainRoadWords, ARecordingCountsOnceInTraining) {
  expect(2, "train s.db s.db --out x.onnx", {"s.db: is given twice"});
  expect(2, "train s.db --validate s.db --out x.onnx", {"for --validate as well"});
  EXPECT_FALSE(fs::exists(folder_ / "x.onnx"));
}

TEST_F(MainRoadWords, ThePlantOfAnotherRobotHasNoGoldArm) {
  const Outcome outcome = run("info " + kEmps);
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.text.find("gold"), std::string::npos) << outcome.text;
  EXPECT_NE(run("info " + kPlant).text.find("gold arm"), std::string::npos);
}

TEST_F(MainRoadWords, WeightsOfAnotherPlantWarn) {
  const std::string other = RAVENCAL_SOURCE_DIR "/tools/plants/raven2_published.toml";
  expect(0,
         fmt::format("host --plugin {} --weights w.blob --plant {} --trajectory t.csv --rate-hz 0 "
                     "--ticks 5000",
                     RAVENCAL_PLUGIN_PATH, other),
         {"the correction makes the error larger", "do not fit"});
}

TEST_F(MainRoadWords, PerfectJointsHaveNoFallAndWideNumbersStayApart) {
  write_csv("off.csv", "lift", "lift", 0.5);
  write_csv("exact.csv", "lift", "lift", 0.0);
  write_csv("far.csv", "lift", "lift", 1e6);
  expect(0, "train off.csv --profile generic --method linear --out lift.onnx", {});
  const Outcome exact = run("evaluate lift.onnx exact.csv --profile generic");
  EXPECT_EQ(exact.exit_code, 0) << exact.text;
  EXPECT_EQ(exact.text.find("nan"), std::string::npos) << exact.text;
  EXPECT_EQ(exact.text.find("inf"), std::string::npos) << exact.text;
  const Outcome far = run("evaluate lift.onnx far.csv --profile generic");
  ASSERT_EQ(far.exit_code, 0) << far.text;
  const std::size_t row = far.text.find("\nlift");
  ASSERT_NE(row, std::string::npos) << far.text;
  std::istringstream words(far.text.substr(row));
  int count = 0;
  for (std::string word; words >> word && word != "%";) ++count;
  EXPECT_EQ(count, 10) << far.text;  // joint, unit, samples, six errors, fall
}

}  // namespace
}  // namespace ravencal::test
