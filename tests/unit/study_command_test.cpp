// SPDX-License-Identifier: Apache-2.0
//
// `ravencal train`, `ablate` and `compare` as a user runs them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "core/whole_file.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "unit/browser.hpp"
#include "unit/run_command.hpp"
#include "unit/study_arm.hpp"

namespace ravencal::study {
namespace {

namespace fs = std::filesystem;
using test::Outcome;

class StudyCommand : public testing::Test {
 protected:
  void SetUp() override {
    train_ = folder_.recording("train.db", 600, 1);
    test_ = folder_.recording("test.db", 500, 2);
    again_ = folder_.recording("again.db", 500, 3);
  }

  [[nodiscard]] Outcome ablate(const std::string& arguments) const {
    return test::run_command(
        fmt::format("{} ablate {} --out {} 2>&1", RAVENCAL_PROGRAM, arguments, out().string()));
  }
  [[nodiscard]] Outcome compare(const std::string& arguments) const {
    return test::run_command(
        fmt::format("{} compare {} --out {} 2>&1", RAVENCAL_PROGRAM, arguments, out().string()));
  }
  [[nodiscard]] Outcome train(const std::string& arguments) const {
    return test::run_command(fmt::format("{} train {} --force --out {} {} 2>&1", RAVENCAL_PROGRAM,
                                         train_, model().string(), arguments));
  }
  [[nodiscard]] fs::path model() const { return folder_.path() / "model.onnx"; }
  [[nodiscard]] fs::path out() const { return folder_.path() / "out"; }
  [[nodiscard]] std::string data() const {
    return fmt::format("--train {} --test {} --hidden 4 --epochs 1 --seeds 1 --workers 1", train_,
                       test_);
  }

  StudyFolder folder_;
  std::string train_, test_, again_;
};

TEST_F(StudyCommand, PlansRunsOneJobAndCollectsOnlyWhatIsWhole) {
  const Outcome planned = ablate("removal " + data() + " --plan");
  EXPECT_EQ(planned.exit_code, 0) << planned.text;
  EXPECT_NE(planned.text.find("19 networks, 19 to train: about"), std::string::npos)
      << planned.text;
  EXPECT_EQ(ablate("removal --job 3").exit_code, 0);
  const Outcome json = ablate("removal --plan --json");
  EXPECT_NE(json.text.find("\"array\":\"0-2,4-18\""), std::string::npos) << json.text;
  const Outcome gap = ablate("removal --collect");
  EXPECT_EQ(gap.exit_code, 3);
  EXPECT_NE(gap.text.find("18 of 19 jobs have no result: 0-2,4-18"), std::string::npos) << gap.text;
  EXPECT_FALSE(fs::exists(out() / "report.html"));
  EXPECT_EQ(ablate("removal --collect --partial").exit_code, 0);
  EXPECT_TRUE(fs::exists(out() / "report.html"));
}

TEST_F(StudyCommand, RunsEveryStudyAndWritesItsTablesInEveryForm) {
  const std::string homing =
      fmt::format(" --train-loaded {0} --test-loaded {1} --test-homing {1} {2} --train-rehomed {0}",
                  train_, test_, again_);
  const Outcome done = ablate("all " + data() + homing);
  ASSERT_EQ(done.exit_code, 0) << done.text;
  EXPECT_NE(done.text.find("Encoder values break after homing"), std::string::npos) << done.text;
  for (const char* file :
       {"tables.csv", "tables.md", "tables.txt", "tables.tex", "findings.json", "report.html"})
    EXPECT_TRUE(fs::exists(out() / file)) << file;
  const auto csv = core::read_whole_file(out() / "tables.csv");
  ASSERT_TRUE(csv.ok());
  for (const char* row :
       {"removal,joint 2,500 g,elbow,", "removal,joint 2,500 g,elbow peak,",
        "inaccurate,velocity,unloaded,insertion", "inaccurate_released,joint 1,unloaded,shoulder",
        "torque,\"torques alone, × −1\",unloaded",
        "homing,\"trained with re-homing: no other poses, only encoder\"",
        "homing_2,all features,elbow [deg],1", "samples,\"unloaded, shoulder\""})
    EXPECT_NE(csv->find(row), std::string::npos) << row;
  if (test::has_browser()) {
    const auto opened = test::open_in_browser(out() / "report.html", out());
    EXPECT_EQ(opened.console, "");
    static const std::regex every_chart(R"(data-charts-drawn="(\d\d)/\1")");
    EXPECT_TRUE(std::regex_search(opened.dom.substr(0, opened.dom.find("<head>")), every_chart));
    for (const char* heading :
         {"Removal of features</h2>", "<h3>500 g</h3>", "<h3>unloaded, insertion</h3>",
          "Re-homing, trained with re-homing</h2>", ">kernels</th>"})
      EXPECT_NE(opened.dom.find(heading), std::string::npos) << heading;
  }
  // The same command again trains nothing and writes the same.
  const Outcome again = ablate("all " + data() + homing);
  EXPECT_EQ(again.text.find("to train"), std::string::npos) << again.text;
  EXPECT_EQ(*core::read_whole_file(out() / "tables.csv"), *csv);
}

TEST_F(StudyCommand, SaysWhichInputChanged) {
  ASSERT_EQ(ablate("torque " + data() + " --plan").exit_code, 0);
  train_ = folder_.recording("train.db", 600, 9);
  const Outcome job = ablate("torque --job 0");
  EXPECT_EQ(job.exit_code, 3);
  EXPECT_NE(job.text.find("train.db: changed since the plan was made"), std::string::npos)
      << job.text;
  const Outcome planned = ablate("torque " + data() + " --plan");
  EXPECT_NE(planned.text.find("train.db changed since the last plan"), std::string::npos)
      << planned.text;
}

TEST_F(StudyCommand, FiguresOfASeedThatTrainingSawSaySoWhereverTheyStand) {
  const auto of_twin = [this](const std::string& name, unsigned motion, int run) {
    record::Recording recording = study_arm(600, motion);
    recording.meta["plant_hash"] = "00ee";
    recording.meta["seed"] = std::to_string(run);
    recording.meta["homing_seed"] = std::to_string(10 * run + static_cast<int>(motion));
    const fs::path path = folder_.path() / name;
    EXPECT_TRUE(record::write_recording(recording, path, true).ok());
    return path.string();
  };
  train_ = of_twin("train.db", 1, 41);
  test_ = of_twin("test.db", 2, 41);
  EXPECT_EQ(ablate("torque " + data()).exit_code, 3);
  ASSERT_EQ(ablate("torque " + data() + " --same-seed").exit_code, 0);
  const std::string words = "has the run seed 41 of train.db";
  for (const bool collected : {false, true}) {
    const Outcome again =
        collected ? ablate("torque --collect") : ablate("torque " + data() + " --same-seed");
    ASSERT_EQ(again.exit_code, 0) << again.text;
    EXPECT_NE(again.text.find(words), std::string::npos) << again.text;
    for (const char* file :
         {"tables.md", "tables.txt", "tables.tex", "findings.json", "report.html"}) {
      EXPECT_NE(core::read_whole_file(out() / file)->find(words), std::string::npos) << file;
      if (!collected) fs::remove(out() / file);
    }
  }
  EXPECT_NE(core::read_whole_file(out() / "plan.json")->find("\"same_seed\""), std::string::npos);
}

TEST_F(StudyCommand, APlanWithResultsIsNotReplacedByAnother) {
  ASSERT_EQ(ablate("torque " + data() + " --plan").exit_code, 0);
  EXPECT_EQ(ablate("torque " + data() + " --batch 64 --plan").exit_code, 0) << "it has no results";
  ASSERT_EQ(ablate("torque " + data() + " --batch 64").exit_code, 0);
  const std::string plan = *core::read_whole_file(out() / "plan.json");
  const std::string paper =
      fmt::format("timeout 60 {} study paper --out {} 2>&1", RAVENCAL_PROGRAM, out().string());
  for (const Outcome& refused :
       {ablate("torque " + data()), ablate("removal " + data() + " --batch 64 --plan"),
        ablate(fmt::format("torque --train {} --test {} --hidden 4 --epochs 1 --seeds 1 --batch 64",
                           train_, again_)),
        test::run_command(paper)}) {
    EXPECT_EQ(refused.exit_code, 2) << refused.text;
    EXPECT_NE(refused.text.find("remove " + (out() / "plan.json").string()), std::string::npos)
        << refused.text;
    EXPECT_EQ(*core::read_whole_file(out() / "plan.json"), plan);
  }
  EXPECT_FALSE(fs::exists(out() / "recordings")) << "it is refused before anything is simulated";
  EXPECT_EQ(ablate("torque " + data() + " --batch 64").exit_code, 0);
}

TEST_F(StudyCommand, UsageErrorsSayWhatToWrite) {
  EXPECT_EQ(ablate("sideways " + data()).exit_code, 2);
  EXPECT_EQ(ablate("torque").exit_code, 2);
  EXPECT_EQ(ablate("torque " + data() + " --plan --collect").exit_code, 2);
  const Outcome features = ablate("torque " + data() + " --features group:colour");
  EXPECT_EQ(features.exit_code, 2);
  EXPECT_NE(features.text.find("colour"), std::string::npos) << features.text;
  EXPECT_EQ(ablate("torque --collect").exit_code, 3);
}

TEST_F(StudyCommand, ThePapersStudyTakesRecordingsOfTheUser) {
  const Outcome done = test::run_command(
      fmt::format("{} study paper {} --test-homing {} {} --train-rehomed {} --out {} 2>&1",
                  RAVENCAL_PROGRAM, data(), test_, again_, train_, out().string()));
  ASSERT_EQ(done.exit_code, 0) << done.text;
  EXPECT_FALSE(fs::exists(out() / "recordings")) << "the twin made some beside";
  for (const char* words :
       {"Removal of features: networks trained without", "Inaccurate features, inputs alone",
        "Inaccurate features, as the authors' code was released", "Modified torque features",
        "Modified pose features"})
    EXPECT_NE(done.text.find(words), std::string::npos) << words << "\n" << done.text;
  const auto csv = core::read_whole_file(out() / "tables.csv");
  ASSERT_TRUE(csv.ok());
  for (const char* theirs : {",12.2552,", ",0.1693,"})  // joint 1 as released; no encoder, re-homed
    EXPECT_NE(csv->find(theirs), std::string::npos) << theirs;
}

TEST_F(StudyCommand, ThePapersStudySimulatesNothingBesideRecordingsOfTheUser) {
  for (const char* option : {"--train", "--test", "--train-loaded", "--test-loaded",
                             "--test-homing", "--train-rehomed"}) {
    const Outcome partly = test::run_command(fmt::format(
        "timeout 60 {} study paper --quick --test-s 60 --epochs 1 --seeds 1 --hidden 2 {} {} --out "
        "{} --plan 2>&1",
        RAVENCAL_PROGRAM, option, train_, out().string()));
    EXPECT_EQ(partly.exit_code, 2) << option << ": " << partly.text;
    EXPECT_NE(partly.text.find("--train and --test"), std::string::npos) << partly.text;
    EXPECT_FALSE(fs::exists(out())) << option;
  }
}

TEST_F(StudyCommand, ThePapersPlanIsListedBeforeItsRecordingsAreMade) {
  for (const std::string words :
       {"28 networks, 28 to train", "32 recordings of the twin, 16.5 h"}) {
    const Outcome listed = test::run_command(
        fmt::format("timeout 120 {} study paper --seeds 1 --hidden 32 --out {} --plan 2>&1",
                    RAVENCAL_PROGRAM, out().string()));
    EXPECT_EQ(listed.exit_code, 0) << listed.text;
    EXPECT_NE(listed.text.find(words), std::string::npos) << listed.text;
    EXPECT_FALSE(fs::exists(out())) << "nothing is written";
  }
}

TEST_F(StudyCommand, ThePapersStudyMakesItsRecordingsOnceAndApart) {
  const std::string command = fmt::format(
      "{} study paper --quick --test-s 60 --epochs 1 --seeds 1 --hidden 2 --out {} "
      "--plan --make-recordings",
      RAVENCAL_PROGRAM, out().string());
  const Outcome planned = test::run_command(command + " 2>&1");
  ASSERT_EQ(planned.exit_code, 0) << planned.text;
  EXPECT_NE(planned.text.find("28 networks, 28 to train"), std::string::npos) << planned.text;
  std::map<std::string, fs::file_time_type> made;
  std::set<std::string> run_seeds;
  for (const auto& entry : fs::recursive_directory_iterator(out() / "recordings")) {
    if (!entry.is_regular_file()) continue;
    const auto recording = record::read_recording(entry.path());
    ASSERT_TRUE(recording.ok()) << recording.error().message;
    made[entry.path().string()] = entry.last_write_time();
    run_seeds.insert(recording->meta.at("seed"));
  }
  EXPECT_EQ(made.size(), 32U);  // 2 x (5 to train on + 6 to test on) + 6 after homings + 4 re-homed
  EXPECT_EQ(run_seeds.size(), made.size());
  ASSERT_EQ(test::run_command(command + " 2>&1").exit_code, 0);
  for (const auto& [path, time] : made) EXPECT_EQ(fs::last_write_time(path), time) << path;
  // The plan that is there is listed, and nothing is simulated for it.
  fs::remove_all(out() / "recordings");
  const Outcome listed = test::run_command(
      fmt::format("{} study paper --out {} --plan 2>&1", RAVENCAL_PROGRAM, out().string()));
  EXPECT_EQ(listed.exit_code, 0) << listed.text;
  EXPECT_NE(listed.text.find("28 networks, 28 to train"), std::string::npos) << listed.text;
  EXPECT_FALSE(fs::exists(out() / "recordings"));
}

TEST_F(StudyCommand, CompareRefusesToTestOnWhatItTrains) {
  const Outcome both = compare(fmt::format("--train {} {} --test {}", train_, test_, test_));
  EXPECT_EQ(both.exit_code, 2) << both.text;
  EXPECT_NE(both.text.find("test.db: is both trained on and tested on"), std::string::npos)
      << both.text;
  EXPECT_FALSE(fs::exists(out()));
  const fs::path copy = folder_.path() / "copy.db";
  fs::copy_file(train_, copy);
  const Outcome copied =
      compare(fmt::format("--train {} --test {} {}", train_, test_, copy.string()));
  EXPECT_EQ(copied.exit_code, 3) << copied.text;
  EXPECT_NE(copied.text.find("copy.db: is both trained on and tested on, with the same bytes as " +
                             train_),
            std::string::npos)
      << copied.text;
  EXPECT_EQ(ablate(fmt::format("torque --train {} --test {}", train_, copy.string())).exit_code, 3);
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(StudyCommand, HiddenLayersAreReadAlikeByEveryCommand) {
  const std::string compared = fmt::format("--train {} --test {}", train_, test_);
  for (const char* wrong : {"--hidden 4,x", "--hidden 4,0", "--hidden 20000"}) {
    for (const Outcome& refused : {train(wrong), compare(compared + " " + wrong),
                                   ablate("torque " + data() + " " + wrong)}) {
      EXPECT_EQ(refused.exit_code, 2) << refused.text;
      EXPECT_NE(refused.text.find("--hidden"), std::string::npos) << refused.text;
    }
  }
  EXPECT_EQ(compare(compared + " --hidden none").exit_code, 2);
  EXPECT_FALSE(fs::exists(model()));
  EXPECT_EQ(train("--hidden none").exit_code, 0);
  EXPECT_TRUE(fs::exists(model()));
}

TEST_F(StudyCommand, TrainSaysWhichPlantsPhysicsTheTwinCannotSimulate) {
  const Outcome refused =
      train("--hidden 4 --physics " RAVENCAL_SOURCE_DIR "/tools/plants/emps.toml");
  EXPECT_EQ(refused.exit_code, 2) << refused.text;
  EXPECT_NE(refused.text.find("the twin cannot run this plant"), std::string::npos) << refused.text;
  EXPECT_FALSE(fs::exists(model()));
}

}  // namespace
}  // namespace ravencal::study
