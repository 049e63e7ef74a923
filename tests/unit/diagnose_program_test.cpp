// SPDX-License-Identifier: Apache-2.0
//
// `ravencal diagnose` and `ravencal suggest` as a user runs them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "diagnose_generator.hpp"
#include "unit/run_command.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;
using test::Outcome;

constexpr const char* kProfile = R"([source]
robot = "two joints"
format = "csv"
time = "t_s"

[[channel]]
name = "one.estimate"
column = "one_rad"
unit = "rad"
role = "joint_estimate"
joint = "one"

[[channel]]
name = "two.estimate"
column = "two_rad"
unit = "rad"
role = "joint_estimate"
joint = "two"

[[channel]]
name = "one.truth"
column = "truth_rad"
unit = "rad"
role = "joint_truth"
joint = "one"
)";

class DiagnoseProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(folder_ / "plant.toml") << generator::plant_text();
    std::ofstream(folder_ / "profile.toml") << kProfile;
    write("a.csv", 1);
    write("b.csv", 2);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, std::uint64_t seed) const {
    const record::Recording recording = generator::make_recording(
        {.offset_rad = 0.05}, {.seed = seed, .duration_s = 60.0, .with_torque = false});
    std::ofstream file(folder_ / name);
    file << "t_s,one_rad,two_rad,truth_rad\n";
    for (Eigen::Index i = 0; i < recording.rows(); ++i)
      file << fmt::format(
          "{},{},{},{}\n", 1e-9 * static_cast<double>(recording.t_ns[static_cast<std::size_t>(i)]),
          recording.samples(i, 0), recording.samples(i, 1), recording.samples(i, 2));
  }

  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return test::run_command(
        fmt::format("cd {} && {} {} 2>&1", folder_.string(), RAVENCAL_PROGRAM, arguments));
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("diagnose_program_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

constexpr const char* kDiagnose =
    "diagnose a.csv --profile profile.toml --plant plant.toml --out why";

TEST_F(DiagnoseProgram, LeavesAReportThatSuggestTakesByItsFolder) {
  const Outcome named = run(kDiagnose);
  EXPECT_EQ(named.exit_code, 0) << named.text;
  EXPECT_NE(named.text.find("homing offset"), std::string::npos) << named.text;
  EXPECT_NE(named.text.find("improved, on the rows that were fitted:"), std::string::npos);
  // The same error in the same unit as in the sentences above it.
  EXPECT_TRUE(std::regex_search(
      named.text, std::regex("one +position error +2\\.[0-9]+ deg -> [0-9.]+ deg \\(floor ")))
      << named.text;
  for (const char* file : {"report.json", "report.html", "plant_improved.toml"})
    EXPECT_TRUE(fs::exists(folder_ / "why" / file)) << file;
  const Outcome again = run(std::string(kDiagnose) + " --held-out b.csv --check");
  EXPECT_EQ(again.exit_code, 1) << "a finding: " << again.text;
  const Outcome next = run("suggest why");
  EXPECT_EQ(next.exit_code, 0) << next.text;
  EXPECT_NE(next.text.find("min)"), std::string::npos) << next.text;
}

TEST_F(DiagnoseProgram, MeasuresItsFalseAlarmsUnlessToldNotTo) {
  const auto rate = [this] {
    return nlohmann::json::parse(
        std::ifstream(folder_ / "why/report.json"))["verdict"]["false_alarm_rate"];
  };
  const Outcome measured = run(kDiagnose);
  EXPECT_NE(measured.text.find("Placebo recordings have the motion of this one"), std::string::npos)
      << measured.text;
  ASSERT_TRUE(rate().is_number());
  EXPECT_LE(rate().get<double>(), 0.25);
  EXPECT_EQ(run(std::string(kDiagnose) + " --placebo 0").exit_code, 0);
  EXPECT_TRUE(rate().is_null());
}

TEST_F(DiagnoseProgram, RefusesToHoldOutWhatItFits) {
  const Outcome both = run(std::string(kDiagnose) + " --held-out ./a.csv");
  EXPECT_EQ(both.exit_code, 2) << both.text;
  EXPECT_NE(both.text.find("./a.csv: is among the recordings to fit"), std::string::npos)
      << both.text;
  EXPECT_FALSE(fs::exists(folder_ / "why"));
}

/// What is asked for and cannot be done is an error of usage, before anything is written.
TEST_F(DiagnoseProgram, LeavesNothingUndoneInSilence) {
  const std::pair<const char*, const char*> wrong[] = {
      {" --held-out-from 100", "--held-out-from 100: no recording is that long; a.csv ends at"},
      {" --held-out-from -1", "--held-out-from: -1 is below 0"},
      {" --held-out b.csv ./b.csv", "b.csv: is given twice"},
      {" ./a.csv", "a.csv: is given twice"},
      {" --held-out-profile profile.toml", "--held-out"},
      {" --simulated-profile profile.toml", "--simulated"},
      {" --held-out b.db --held-out-profile profile.toml",
       "--held-out-profile: is not read, since b.db needs no profile"},
  };
  for (const auto& [option, complaint] : wrong) {
    const Outcome outcome = run(std::string(kDiagnose) + option);
    EXPECT_EQ(outcome.exit_code, 2) << option << ": " << outcome.text;
    EXPECT_NE(outcome.text.find(complaint), std::string::npos) << option << ": " << outcome.text;
  }
  EXPECT_FALSE(fs::exists(folder_ / "why"));
}

TEST_F(DiagnoseProgram, SaysHowFarItTakesRowsWithoutTimeToBeApart) {
  std::string text = kProfile;
  text.erase(text.find("time = "), std::string_view("time = \"t_s\"\n").size());
  std::ofstream(folder_ / "rows.toml") << text;
  const Outcome assumed =
      run("diagnose a.csv --profile rows.toml --plant plant.toml --out why --placebo 0");
  EXPECT_EQ(assumed.exit_code, 0) << assumed.text;
  EXPECT_NE(assumed.text.find("a.csv has no time in each row, so that its rows count as 0.01 s"),
            std::string::npos)
      << assumed.text;
  const Outcome kept = run("import a.csv --profile rows.toml --out a.db");
  EXPECT_NE(kept.text.find("rows count as 0.01 s apart"), std::string::npos) << kept.text;
  const Outcome later = run("diagnose a.db --plant plant.toml --out why --placebo 0");
  EXPECT_NE(later.text.find("a.db has no time in each row"), std::string::npos) << later.text;
}

/// Two profiles may take different rows of one file.
TEST_F(DiagnoseProgram, HoldsOutWhatAnotherProfileTakesFromTheSameFile) {
  std::ofstream(folder_ / "others.toml") << kProfile;
  const Outcome other =
      run(std::string(kDiagnose) + " --held-out a.csv --held-out-profile others.toml");
  EXPECT_EQ(other.exit_code, 0) << other.text;
}

TEST_F(DiagnoseProgram, SaysWhichFileIsMissing) {
  EXPECT_EQ(run("suggest nothing/report.json").exit_code, 3);
  const Outcome no_plant = run("diagnose a.csv --profile profile.toml --plant no.toml --out why");
  EXPECT_EQ(no_plant.exit_code, 3);
  EXPECT_NE(no_plant.text.find("no.toml"), std::string::npos) << no_plant.text;
}

}  // namespace
