// SPDX-License-Identifier: Apache-2.0
//
// A test on the twin is refused where it shares a run seed with the training.
#include "learn/shared_seeds.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "learn/evaluate.hpp"
#include "learn/model_description.hpp"
#include "learn/train.hpp"
#include "unit/learn/sample_arm.hpp"

namespace ravencal::learn {
namespace {

using record::Recording;

/// As `simulate` writes it, but for the motion.
Recording simulated(const std::string& source, int run, int homing, int rehomings = 0) {
  Recording recording = sample_arm(400, static_cast<unsigned>(run));
  recording.source = source;
  recording.meta = {{"plant_hash", "00ff"},
                    {"seed", std::to_string(run)},
                    {"homing_seed", std::to_string(homing)},
                    {"rehomings", std::to_string(rehomings)}};
  return recording;
}

SharedSeeds between(const Recording& trained, const Recording& tested) {
  const Recording* const training[] = {&trained};
  const Recording* const tests[] = {&tested};
  return shared_seeds(seeds_of(training), tests);
}

core::Result<TrainResult> trained_on(std::span<const Recording* const> training,
                                     std::span<const Recording* const> validation = {},
                                     const TrainOptions& given = {}) {
  TrainOptions options = given;
  options.hidden.clear();
  return train_model(training, validation, options, [](const EpochReport&) { return true; });
}

TEST(SharedSeeds, ARunSeedOfTheTrainingIsRefusedByFilesSeedAndRemedy) {
  const Recording trained = simulated("runs/z2.db", 2, 1);
  const SharedSeeds shared = between(trained, simulated("tests/s1.db", 2, 9));
  const core::Status status = check_run_seeds(shared);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kData);
  for (const char* words : {"tests/s1.db", "run seed 2", "z2.db", "--seed", "--same-seed"})
    EXPECT_NE(status.error().message.find(words), std::string::npos) << status.error().message;
  EXPECT_TRUE(shared.homings.empty());
}

TEST(SharedSeeds, OneHomingIsSaidAndNotRefused) {
  const SharedSeeds shared = between(simulated("z2.db", 2, 7), simulated("tests/s1.db", 3, 7));
  EXPECT_TRUE(check_run_seeds(shared).ok());
  ASSERT_EQ(sentences_of(shared).size(), 1U);
  for (const char* words : {"one homing", "tests/s1.db", "seed 7", "z2.db"})
    EXPECT_NE(sentences_of(shared)[0].find(words), std::string::npos) << sentences_of(shared)[0];
}

TEST(SharedSeeds, AnotherHomingOfOneSessionIsAnother) {
  EXPECT_TRUE(between(simulated("a.db", 2, 7), simulated("b.db", 3, 7, 1)).empty());
}

TEST(SharedSeeds, RecordingsOfRobotsHaveNone) {
  const Recording twin = simulated("twin.db", 2, 1);
  Recording robot = twin;
  robot.meta = {{"seed", "2"}, {"homing_seed", "1"}};
  EXPECT_TRUE(between(twin, robot).empty());
  EXPECT_TRUE(between(robot, twin).empty());
  Recording damaged = twin;
  damaged.meta["seed"] = "two";
  EXPECT_TRUE(between(twin, damaged).empty());
}

TEST(SharedSeeds, TrainingKeepsThoseOfAllThatShapedTheModel) {
  const Recording first = simulated("runs/a.db", 1, 11), chooses = simulated("b.db", 2, 12);
  const Recording imagined = simulated("simulation", 3001, 3001), robot = sample_arm(400, 5);
  const Recording* const training[] = {&first, &robot};
  const Recording* const validation[] = {&chooses};
  TrainOptions options;
  options.simulated = {&imagined};
  options.simulated_trainer.epochs = 1;
  const auto result = trained_on(training, validation, options);
  ASSERT_TRUE(result.ok()) << result.error().message;
  const std::vector<model::RandomSeeds> expected = {
      {"a.db", 1, 11, 0}, {"b.db", 2, 12, 0}, {"simulation", 3001, 3001, 0}};
  EXPECT_EQ(result->model.seeds, expected);
  const std::string words = describe_in_words(result->model);
  EXPECT_NE(words.find("simulated: a.db, run seed 1, homing seed 11"), std::string::npos) << words;
  const auto json = nlohmann::json::parse(describe_in_json(result->model));
  EXPECT_EQ(json["seeds"][1]["seed"], 2);
}

TEST(SharedSeeds, TheTableAndTheJsonSayWhatWasAllowed) {
  const Recording trained = simulated("z2.db", 2, 1);
  const Recording* const training[] = {&trained};
  const auto result = trained_on(training);
  ASSERT_TRUE(result.ok()) << result.error().message;
  auto evaluation = evaluate(result->model, training);
  ASSERT_TRUE(evaluation.ok());
  const std::string honest = evaluation_table(*evaluation);
  EXPECT_EQ(honest.find("seed"), std::string::npos) << honest;
  EXPECT_FALSE(nlohmann::json::parse(evaluation_json(*evaluation)).contains("same_seed"));

  evaluation->shared = shared_seeds(result->model.seeds, training);
  const std::string said = evaluation_table(*evaluation);
  EXPECT_NE(said.find("same seed: z2.db has the run seed 2 of z2.db"), std::string::npos) << said;
  EXPECT_NE(said.find("one homing: "), std::string::npos) << said;
  const auto json = nlohmann::json::parse(evaluation_json(*evaluation));
  for (const char* key : {"same_seed", "one_homing"}) {
    ASSERT_EQ(json[key].size(), 1U) << key;
    EXPECT_EQ(json[key][0]["tested"], "z2.db");
    EXPECT_EQ(json[key][0]["trained"], "z2.db");
  }
  EXPECT_EQ(json["same_seed"][0]["seed"], 2);
}

}  // namespace
}  // namespace ravencal::learn
