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

TEST_F(MainRoadWords, APlantThatIsNoRavenIsFollowed) {
  expect(2, "simulate --plant " + kEmps + " --trajectory t.csv --out x.db",
         {"--follow", "carriage", "RAVEN"});
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
  expect(2, "export s.db --out kept.csv", {"kept.csv", "--overwrite"});
  EXPECT_EQ(bytes_of(folder_ / "kept.csv"), "mine\n");
  expect(0, "export s.db --out kept.csv --overwrite", {"rows"});
}

TEST_F(MainRoadWords, APlantThatIsNoTomlSaysSo) {
  expect(3, "simulate --plant s.db --trajectory t.csv --out x.db", {"a plant is TOML"});
}

TEST_F(MainRoadWords, EvaluationOnTrainingDataWarnsUnderAnyName) {
  fs::copy_file(folder_ / "s.db", folder_ / "copy.db", fs::copy_options::overwrite_existing);
  expect(0, "evaluate m.onnx copy.db", {"copy.db: the model was trained on it"});
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
