// SPDX-License-Identifier: Apache-2.0
//
// plan.json and results that somebody wrote otherwise than the program does.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/whole_file.hpp"
#include "study/job_store.hpp"
#include "study/pool.hpp"
#include "study/results.hpp"
#include "unit/study_arm.hpp"

namespace ravencal::study {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class StudyFiles : public testing::Test {
 protected:
  [[nodiscard]] Plan plan(const std::string& study) {
    Settings settings;
    settings.hidden = {5};
    settings.epochs = 1;
    settings.batch = 128;
    settings.seeds = 2;
    Condition condition;
    condition.title = "unloaded";
    condition.train = {folder_.recording("train.db", 800, 4)};
    condition.test = {folder_.recording("test.db", 650, 6)};
    auto made = make_plan(study, settings, {}, {condition}, recordings_);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
    return std::move(made).value();
  }

  StudyFolder folder_;
  RecordingStore recordings_{record::LoadOptions{}};
};

/// One value of a file of JSON is another: where it stands, what it becomes, what the refusal
/// names.
struct Slip {
  const char* pointer;
  Json value;
  const char* named;
};

void expect_refusals(const fs::path& file, const std::vector<Slip>& slips,
                     const std::function<core::Status()>& read) {
  const std::string whole = *core::read_whole_file(file);
  for (const Slip& slip : slips) {
    Json json = Json::parse(whole);
    json[Json::json_pointer(slip.pointer)] = slip.value;
    ASSERT_TRUE(core::write_whole_file(file, json.dump()).ok());
    const core::Status status = read();
    ASSERT_FALSE(status.ok()) << slip.pointer << " " << slip.value;
    EXPECT_EQ(status.error().code, core::ErrorCode::kData);
    for (const std::string& words : {file.string(), std::string(slip.named)})
      EXPECT_NE(status.error().message.find(words), std::string::npos)
          << slip.pointer << ": " << status.error().message;
  }
  ASSERT_TRUE(core::write_whole_file(file, whole).ok());
  EXPECT_TRUE(read().ok());
}

TEST_F(StudyFiles, APlanOfImpossibleValuesIsRefusedByItsKey) {
  ASSERT_TRUE(write_plan(plan("removal"), folder_.path()).ok());
  expect_refusals(plan_path(folder_.path()),
                  {{"/settings/batch", 0, "settings.batch"},
                   {"/settings/epochs", 0, "settings.epochs"},
                   {"/settings/epochs", -1, "settings.epochs"},
                   {"/settings/epochs", 2.5, "settings.epochs"},
                   {"/settings/seeds", 0, "settings.seeds"},
                   {"/settings/hidden", Json::array(), "settings.hidden"},
                   {"/settings/hidden/0", 0, "settings.hidden[0]"},
                   {"/settings/kernels", "abacus", "settings.kernels"},
                   {"/study", "sideways", "study"},
                   {"/conditions", Json::array(), "conditions"},
                   {"/conditions/0/test", Json::array(), "conditions[0].test"},
                   {"/conditions/0/train", "train.db", "conditions[0].train"},
                   {"/jobs", Json::array(), "jobs"},
                   {"/jobs/1/condition", 7, "jobs[1].condition"},
                   {"/jobs/1/width", 0, "jobs[1].width"},
                   {"/inputs/0/rows", "many", "inputs[0].rows"}},
                  [&]() -> core::Status {
                    const auto read = read_plan(folder_.path());
                    return read.ok() ? core::Status() : core::Status(read.error());
                  });
}

TEST_F(StudyFiles, AResultOfAnotherShapeIsRefusedByItsKey) {
  const Plan made = plan("torque");
  const fs::path& folder = folder_.path();
  ASSERT_TRUE(run_all(made, folder, recordings_, {1, 1}, [](double, const std::string&) {
                return true;
              }).ok());
  const fs::path file = result_path(folder, made.jobs[1].key);
  const Json blocks = Json::parse(*core::read_whole_file(file))["rows"][0]["joints"][0][0];
  Json shorter = blocks;
  shorter["counts"] = {500};
  shorter["squares"] = {0.1};
  expect_refusals(file,
                  {{"/rows/0/joints", Json::array(), "rows[0].joints"},
                   {"/rows/2/joints/1", Json::array(), "rows[2].joints[1]"},
                   {"/rows/2/joints/1/0", shorter, "rows[2].joints"},
                   {"/rows/0/joints/0/0/counts/0", -5, "counts[0]"},
                   {"/rows/0/joints/0/0/squares/0", -0.5, "squares[0]"},
                   {"/rows/0/joints/0/0/squares", Json::array(), "squares"},
                   {"/rows/0/row", "bias", "rows[1].row"},
                   {"/rows/0/row", "sideways", "rows[0].row"},
                   {"/rows", Json::array(), "rows"},
                   {"/joints", Json::array(), "joints"},
                   {"/joints/0/name", 3, "joints[0].name"},
                   {"/joints/0/name", "wrist", "joints"},
                   {"/maps/0/joints", Json::array(), "maps[0].joints"},
                   {"/maps/0/joints/0/rmse", Json::array(), "maps[0].joints[0].rmse"},
                   {"/grid/columns", 0, "grid.columns"},
                   {"/block_s", 60.0, "block_s"},
                   {"/final_loss", "small", "final_loss"}},
                  [&]() -> core::Status {
                    const auto read = read_results(made, folder);
                    return read.ok() ? core::Status() : core::Status(read.error());
                  });
}

}  // namespace
}  // namespace ravencal::study
