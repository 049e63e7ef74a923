// SPDX-License-Identifier: Apache-2.0
//
// Plans and jobs: what names a result, who may run it, and what is left when one is stopped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/whole_file.hpp"
#include "record/recording_writer.hpp"
#include "study/job_store.hpp"
#include "study/pool.hpp"
#include "study/results.hpp"
#include "study/test_noise.hpp"
#include "unit/study_arm.hpp"

namespace ravencal::study {
namespace {

namespace fs = std::filesystem;

Settings tiny() {
  Settings settings;
  settings.hidden = {6};
  settings.epochs = 2;
  settings.batch = 256;
  settings.seeds = 2;
  return settings;
}

const JobProgress kGoOn = [](double) { return true; };
const PoolProgress kPoolGoesOn = [](double, const std::string&) { return true; };

class StudyJobs : public testing::Test {
 protected:
  void SetUp() override {
    train_ = folder_.recording("train.db", 900, 1);
    test_ = folder_.recording("test.db", 700, 2);
  }

  [[nodiscard]] Plan plan(const std::string& study) {
    Condition condition;
    condition.title = "unloaded";
    condition.train = {train_};
    condition.test = {test_};
    condition.homing = study == "homing";
    auto made = make_plan(study, tiny(), {}, {condition}, recordings_);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
    return std::move(made).value();
  }

  [[nodiscard]] fs::path out(const std::string& name) const {
    fs::create_directories(folder_.path() / name / "jobs");
    return folder_.path() / name;
  }

  static std::map<std::string, std::string> bytes_in(const fs::path& folder) {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : fs::directory_iterator(folder / "jobs")) {
      bytes[entry.path().filename()] = *core::read_whole_file(entry.path());
    }
    return bytes;
  }

  StudyFolder folder_;
  RecordingStore recordings_{record::LoadOptions{}};
  std::string train_;
  std::string test_;
};

TEST_F(StudyJobs, TheRemovalPlanHasOneNetworkPerRowAndSeed) {
  const Plan made = plan("removal");
  EXPECT_EQ(made.jobs.size(), 2U * (1U + ablated_sets().size()));
  EXPECT_TRUE(made.left_out.empty());
  std::set<std::string> keys;
  for (const Job& job : made.jobs) keys.insert(job.key);
  EXPECT_EQ(keys.size(), made.jobs.size());
  EXPECT_EQ(made.jobs[0].seed, 3U);
  EXPECT_EQ(made.jobs[1].seed, 13U);
}

TEST_F(StudyJobs, InaccurateAndTorqueTrainNothingBeyondTheBaseline) {
  EXPECT_EQ(plan("inaccurate").jobs.size(), 2U);
  EXPECT_EQ(plan("torque").jobs.size(), 2U);
  // It is the same network as removal's first row, so one result serves both.
  EXPECT_EQ(plan("torque").jobs[0].key, plan("removal").jobs[0].key);
}

TEST_F(StudyJobs, APlanIsReadBackAsItWasWritten) {
  Plan made = plan("all");
  made.load.range.to_s = 4.5;
  ASSERT_TRUE(write_plan(made, folder_.path()).ok());
  const auto read = read_plan(folder_.path());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_FALSE(read->load.range.from_s);
  EXPECT_EQ(read->load.range.to_s, 4.5);
  EXPECT_NE(description_of(made, made.jobs[0]), description_of(plan("all"), made.jobs[0]));
  ASSERT_EQ(read->jobs.size(), made.jobs.size());
  for (std::size_t i = 0; i < made.jobs.size(); ++i) {
    EXPECT_EQ(read->jobs[i].key, made.jobs[i].key);
    EXPECT_EQ(description_of(*read, read->jobs[i]), description_of(made, made.jobs[i]));
  }
}

TEST_F(StudyJobs, ADamagedPlanIsRefusedWithTheReason) {
  ASSERT_TRUE(core::write_whole_file(plan_path(folder_.path()), "{\"schema\":1}").ok());
  const auto read = read_plan(folder_.path());
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("study"), std::string::npos) << read.error().message;
}

TEST_F(StudyJobs, WhatIsTrainedOnIsNotTestedOnUnderAnyName) {
  const fs::path copy = folder_.path() / "copy.db";
  fs::copy_file(train_, copy);
  const fs::path link = folder_.path() / "link.db";
  fs::create_symlink(train_, link);
  const std::string detour = (folder_.path() / "." / "train.db").string();
  for (const std::string& same : {train_, copy.string(), link.string(), detour}) {
    Condition condition;
    condition.title = "unloaded";
    condition.train = {train_};
    condition.test = {test_, same};
    const auto made = make_plan("removal", tiny(), {}, {condition}, recordings_);
    ASSERT_FALSE(made.ok()) << same;
    EXPECT_EQ(made.error().code, core::ErrorCode::kData);
    for (const std::string& named : {train_, same})
      EXPECT_NE(made.error().message.find(named), std::string::npos) << made.error().message;
  }
}

TEST_F(StudyJobs, WhatIsTrainedOnIsNotTestedOnWhenWrittenAgain) {
  record::Recording again = study_arm(900, 1);
  again.meta["note"] = "exported and imported";
  for (std::int64_t& t_ns : again.t_ns) t_ns += 77'000'000;
  ASSERT_TRUE(record::write_recording(again, test_, true).ok());
  Condition condition;
  condition.title = "unloaded";
  condition.train = {train_};
  condition.test = {test_};
  const auto made = make_plan("removal", tiny(), {}, {condition}, recordings_);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().code, core::ErrorCode::kData);
  for (const std::string& named : {train_, test_})
    EXPECT_NE(made.error().message.find(named), std::string::npos) << made.error().message;
}

TEST_F(StudyJobs, ResultsAreTheSameBytesForAnyPoolAndOrder) {
  const Plan made = plan("torque");
  const fs::path one = out("one");
  const fs::path many = out("many");
  const fs::path by_hand = out("by_hand");
  ASSERT_TRUE(run_all(made, one, recordings_, {1, 1}, kPoolGoesOn).ok());
  ASSERT_TRUE(run_all(made, many, recordings_, {3, 2}, kPoolGoesOn).ok());
  for (std::size_t job = made.jobs.size(); job-- > 0;) {
    RecordingStore own{record::LoadOptions{}};
    ASSERT_TRUE(run_one(made, job, by_hand, own, 1, kGoOn).ok());
  }
  EXPECT_EQ(bytes_in(one).size(), 2U);
  EXPECT_EQ(bytes_in(one), bytes_in(many));
  EXPECT_EQ(bytes_in(one), bytes_in(by_hand));
}

TEST_F(StudyJobs, AStoppedRunLeavesWholeResultsAndGoesOnWithoutRepeating) {
  const Plan made = plan("removal");
  const fs::path folder = out("stopped");
  int calls = 0;
  const auto stopped = run_all(made, folder, recordings_, {1, 1},
                               [&](double, const std::string&) { return ++calls < 200; });
  ASSERT_TRUE(stopped.ok());
  EXPECT_TRUE(stopped->interrupted);
  EXPECT_GT(stopped->ran, 0U);
  EXPECT_EQ(bytes_in(folder).size(), stopped->ran);
  const auto missing = missing_jobs(made, folder);
  ASSERT_TRUE(missing.ok()) << "a result is damaged";
  EXPECT_EQ(missing->size(), made.jobs.size() - stopped->ran);
  const auto rest = run_all(made, folder, recordings_, {1, 1}, kPoolGoesOn);
  ASSERT_TRUE(rest.ok());
  EXPECT_EQ(rest->ran, missing->size());
  EXPECT_EQ(rest->there_already, stopped->ran);
}

TEST_F(StudyJobs, AChangedInputIsFoundAndItsJobsAreOthers) {
  const Plan before = plan("torque");
  std::ofstream(train_, std::ios::app) << "x";
  const core::Status refused = run_one(before, 0, out("changed"), recordings_, 1, kGoOn);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("train.db"), std::string::npos);
  EXPECT_NE(plan("torque").jobs[0].key, before.jobs[0].key);
}

TEST_F(StudyJobs, AResultThatIsDamagedOrAnothersIsRefusedByName) {
  const Plan made = plan("torque");
  const fs::path folder = out("damaged");
  ASSERT_TRUE(run_one(made, 0, folder, recordings_, 1, kGoOn).ok());
  fs::copy_file(result_path(folder, made.jobs[0].key), result_path(folder, made.jobs[1].key));
  const auto anothers = read_result(made, made.jobs[1], folder);
  ASSERT_FALSE(anothers.ok());
  EXPECT_NE(anothers.error().message.find("another job"), std::string::npos);
  fs::resize_file(result_path(folder, made.jobs[0].key), 1000);
  EXPECT_FALSE(read_result(made, made.jobs[0], folder).ok());
  EXPECT_FALSE(read_results(made, folder).ok());
}

TEST_F(StudyJobs, ATestWhoseClockJumpsYearsHasItsResult) {
  record::Recording jumps = study_arm(700, 5);
  for (std::size_t i = 400; i < jumps.t_ns.size(); ++i) jumps.t_ns[i] += 8'000'000'000'000'000'000;
  ASSERT_TRUE(record::write_recording(jumps, test_, true).ok());
  const Plan made = plan("torque");
  const auto done = run_job(made, made.jobs[0], recordings_, 1, kGoOn);
  ASSERT_TRUE(done.ok() && done->has_value()) << (done.ok() ? "" : done.error().message);
  EXPECT_EQ((*done)->rows.front().joints.front().front().counts.size(), 3U);
}

TEST_F(StudyJobs, JobsThatThePlanLacksAreAUsageError) {
  const core::Status status = run_one(plan("torque"), 2, out("none"), recordings_, 1, kGoOn);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kUsage);
}

TEST_F(StudyJobs, HomingNeedsItsSuspectsApartAndTogether) {
  std::set<std::string> rows;
  for (const Job& job : plan("homing").jobs) rows.insert(job.row);
  EXPECT_EQ(rows, (std::set<std::string>{"all", "no_encoder", "no_encoder_offset",
                                         "no_encoder_value", "no_void", "only_encoder"}));
}

TEST_F(StudyJobs, NoiseSpoilsTheChosenColumnsOnlyAndAsItSays) {
  const Plan made = plan("torque");
  const auto recording = recordings_.get(train_);
  ASSERT_TRUE(recording.ok());
  const record::Recording* const training[] = {*recording};
  const auto trained = learn::train_model(training, {}, train_options(made, made.jobs[0], 1),
                                          [](const learn::EpochReport&) { return true; });
  ASSERT_TRUE(trained.ok());
  const model::CalibrationModel& network = trained->model;
  const auto inputs = model::feature_matrix(network.features, **recording);
  ASSERT_TRUE(inputs.ok());
  const auto columns = columns_of(network, (*recording)->channels, {"tau.*"});
  ASSERT_EQ(columns.size(), 7U);
  const ColumnRanges ranges = ranges_of_training(network);
  const auto flipped = spoil(*inputs, ranges, columns, Noise::kFlip, 1);
  const auto noisy = spoil(*inputs, ranges, columns, Noise::kDeviation, 1);
  const auto wide = spoil(*inputs, ranges, columns, Noise::kRange, 1);
  for (Eigen::Index c = 0; c < inputs->cols(); ++c) {
    const bool chosen = std::find(columns.begin(), columns.end(), c) != columns.end();
    EXPECT_EQ(flipped.col(c), (chosen ? -1.0F : 1.0F) * inputs->col(c));
    const auto largest = [&](const model::FeatureMatrix& spoilt) {
      return static_cast<double>((spoilt.col(c) - inputs->col(c)).cwiseAbs().maxCoeff());
    };
    // 900 draws from ± a bound: the largest is beyond 0.97 of it but for one run in 10^11.
    const double deviation = network.input.scale(c);
    EXPECT_GE(largest(noisy), chosen ? 0.97 * deviation : 0.0);
    EXPECT_LE(largest(noisy), chosen ? 1.0001 * deviation : 0.0);
    const double half_range = 0.5 * (network.input_max(c) - network.input_min(c));
    EXPECT_GE(largest(wide), chosen ? 0.97 * half_range : 0.0);
    EXPECT_LE(largest(wide), chosen ? 1.0001 * half_range : 0.0);
  }
  EXPECT_EQ(noisy, spoil(*inputs, ranges, columns, Noise::kDeviation, 1));
  EXPECT_NE(noisy, spoil(*inputs, ranges, columns, Noise::kDeviation, 2));
  // The rows that were trained on have the deviation of the training.
  const model::FeatureMatrix* const rows[] = {&*inputs};
  const ColumnRanges tested = ranges_of_tests(rows);
  for (const Eigen::Index c : columns) {
    EXPECT_NEAR(tested.deviation(c), ranges.deviation(c), 1e-4 * ranges.deviation(c));
    EXPECT_NEAR(tested.mean(c), ranges.mean(c), 1e-4);
  }
}

/// The believed angles of joints 1 and 2 are views of the notebook's test rows, joint 3's is a
/// copy.
TEST_F(StudyJobs, ReleasedNoiseIsInTheBelievedAnglesOfJointsOneAndTwoOnly) {
  const Plan made = plan("inaccurate");
  const auto done = run_job(made, made.jobs[0], recordings_, 1, kGoOn);
  ASSERT_TRUE(done.ok() && done->has_value());
  const auto rmse = [&](const std::string& id, std::size_t joint) {
    for (const RowErrors& row : (*done)->rows) {
      if (row.id == id) return row.joints[joint].front().rmse();
    }
    ADD_FAILURE() << "no test " << id;
    return 0.0;
  };
  const auto test = recordings_.get(test_);
  ASSERT_TRUE(test.ok());
  for (const std::string_view set : {kJointPoses, kAllPoses}) {
    for (const std::size_t joint : {0UL, 1UL, 2UL}) {
      const double inputs = rmse(variant_id(Noise::kDeviation, set), joint);
      const double released = rmse(released_id(set), joint);
      if (joint == 2) {
        EXPECT_DOUBLE_EQ(released, inputs);
        continue;
      }
      const auto column = (*test)->column(
          (*done)->joints[joint].name == "shoulder" ? "jpos.shoulder" : "jpos.elbow");
      ASSERT_TRUE(column.has_value());
      const auto values = (*test)->samples.col(*column);
      const double deviation = std::sqrt((values.array() - values.mean()).square().mean());
      EXPECT_NEAR(released, std::hypot(inputs, deviation / std::sqrt(3.0)), 0.1 * released);
      EXPECT_GT(released, 2.0 * inputs);
    }
  }
  EXPECT_GT(rmse(released_id(joint_set(1)), 0), 2.0 * rmse(released_id(joint_set(1)), 1));
  EXPECT_EQ(released_id(joint_set(3)), variant_id(Noise::kDeviation, joint_set(3)));
}

TEST_F(StudyJobs, ThePaperPlanHasItsRowsAndNoOthers) {
  const Plan made = plan("paper");
  EXPECT_EQ(made.jobs.size(), 2U * (1U + paper_sets().size()));
  for (const Job& job : made.jobs)
    EXPECT_EQ(job.tests, job.row == kNoAblation ? TestSet::kPaper : TestSet::kPlain);
  EXPECT_EQ(paper_sets().size(), 10U);
  EXPECT_EQ(grouped_sets().size(), 7U);
}

TEST_F(StudyJobs, NoiseOfTheTrainingRowsIsAnotherJob) {
  Plan made = plan("torque");
  const std::string of_tests = description_of(made, made.jobs[0]);
  made.settings.noise_from = NoiseFrom::kTraining;
  EXPECT_NE(description_of(made, made.jobs[0]), of_tests);
}

TEST_F(StudyJobs, AFeatureThatCarriesTheErrorIsFoundOut) {
  Settings settings = tiny();
  settings.hidden = {16};
  settings.epochs = 150;
  settings.seeds = 1;
  settings.features = "jpos.*,tau.*,dac.*,time";
  Condition condition;
  condition.title = "unloaded";
  condition.train = {train_};
  condition.test = {test_};
  auto made = make_plan("removal", settings, {}, {condition}, recordings_);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_FALSE(made->left_out.empty());  // e.g. no motor pose among these features
  const fs::path folder = out("carries");
  ASSERT_TRUE(run_all(*made, folder, recordings_, {1, 1}, kPoolGoesOn).ok());
  const auto results = read_results(*made, folder);
  ASSERT_TRUE(results.ok());
  ASSERT_EQ(results->conditions.size(), 1U);
  const ConditionResults& own = results->conditions.front();
  const Tested none{RowId{}, {}};
  const Tested without{{"torque_and_current", std::string(kNoAblation)}, {}};
  ASSERT_TRUE(own.has(without.row));
  EXPECT_GT(own.ratio(without, none, own.all_joints()).interval.low, 1.5);
  EXPECT_EQ(own.maps.size(), 3U);
  ASSERT_TRUE(own.grid.has_value());
}

}  // namespace
}  // namespace ravencal::study
