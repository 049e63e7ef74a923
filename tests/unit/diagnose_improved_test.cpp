// SPDX-License-Identifier: Apache-2.0
//
// The loop closes through a file: plant_improved.toml of several plants runs in `simulate` as it is
// and is nearer to the robot than the plant that was diagnosed, on a motion that no fit saw.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "diagnose/diagnose.hpp"
#include "diagnose/report/write_report.hpp"
#include "record/load.hpp"
#include "simulation/session.hpp"
#include "trajectory/trajectory.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;

struct Change {
  const char* name;
  const char* joint;
  const char* from;           ///< in the robot's plant, first after the joint's name
  const char* to;             ///< in the plant that is diagnosed
  const char* left_out = "";  ///< of the joint too, in the robot's plant
};

/// The twin at work, read back; its file is gone afterwards.
record::Recording simulated_as(const std::string& name, const physics::Plant& plant,
                               const trajectory::Trajectory& motion,
                               simulation::SessionOptions options) {
  const fs::path path =
      fs::path(::testing::TempDir()) / fmt::format("improved_{}_{}.db", name, plant.hash);
  options.overwrite = true;
  const auto done =
      simulation::record_session(plant, motion, path, options, [](double) { return true; });
  EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
  auto recording = record::load_recording(path, {});
  EXPECT_TRUE(recording.ok()) << (recording.ok() ? "" : recording.error().message);
  fs::remove(path);
  return std::move(recording).value();
}

class Improved : public ::testing::TestWithParam<Change> {
 protected:
  static std::string robot_text() {
    std::ifstream file(fs::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2.toml");
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  static physics::Plant saved(const std::string& text, const std::string& name) {
    const fs::path path = fs::path(::testing::TempDir()) / ("improved_" + name + ".toml");
    std::ofstream(path) << text;
    auto plant = physics::load_plant(path);
    EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
    return plant.value();
  }

  static record::Recording simulated(const physics::Plant& plant,
                                     const trajectory::Trajectory& motion) {
    return simulated_as(GetParam().name, plant, motion, {});
  }
};

/// How far the joint's error (truth - estimate) is from the robot's, RMS.
double distance(const record::Recording& a, const record::Recording& b, const std::string& joint) {
  const auto error = [&](const record::Recording& r, Eigen::Index i) {
    return r.samples(i, *r.column(record::Role::kJointTruth, joint)) -
           r.samples(i, *r.column(record::Role::kJointEstimate, joint));
  };
  double sum = 0.0;
  const Eigen::Index rows = std::min(a.rows(), b.rows());
  for (Eigen::Index i = 0; i < rows; ++i) sum += std::pow(error(a, i) - error(b, i), 2);
  return std::sqrt(sum / static_cast<double>(rows));
}

TEST_P(Improved, RunsInSimulateAsItIsAndIsNearerToTheRobot) {
  const Change& change = GetParam();
  std::string text = robot_text();
  const physics::Plant robot = saved(text, std::string(change.name) + "_robot");
  const auto joint_at = text.find(fmt::format("name = \"{}\"", change.joint));
  const auto at = text.find(change.from, joint_at);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, std::string(change.from).size(), change.to);
  if (*change.left_out != 0) {
    const auto there = text.find(change.left_out, joint_at);
    ASSERT_NE(there, std::string::npos);
    text.erase(there, std::string(change.left_out).size());
  }
  const physics::Plant nominal = saved(text, change.name);
  trajectory::RandomOptions training;
  training.duration_s = 90.0;
  const auto motion = trajectory::make_random(training);
  ASSERT_TRUE(motion.ok());
  diagnose::Options options;
  options.threads = 1;
  const auto report = diagnose::diagnose({simulated(robot, *motion)}, {}, nominal, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const std::string improved_text = diagnose::improved_text(*report);
  const physics::Plant improved = saved(improved_text, std::string(change.name) + "_improved");
  trajectory::RandomOptions unseen;
  unseen.duration_s = 40.0;
  unseen.seed = 5;
  const auto test_motion = trajectory::make_random(unseen);
  ASSERT_TRUE(test_motion.ok());
  const record::Recording real = simulated(robot, *test_motion);
  const double before = distance(simulated(nominal, *test_motion), real, change.joint);
  const double after = distance(simulated(improved, *test_motion), real, change.joint);
  EXPECT_LT(after, 0.7 * before) << report->verdict.text << "\n" << improved_text;
}

/// Each is a session of its own, with its homing offsets, its wander and friction that varies, as
/// the plant says that they do.
class TwinAsItsPlant : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(TwinAsItsPlant, HasNothingLeftOut) {
  const auto plant =
      physics::load_plant(fs::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2.toml");
  ASSERT_TRUE(plant.ok());
  trajectory::RandomOptions motion;
  motion.duration_s = 120.0;
  motion.seed = GetParam();
  const auto path = trajectory::make_random(motion);
  ASSERT_TRUE(path.ok());
  simulation::SessionOptions session;
  session.seed = session.homing_seed = GetParam();
  diagnose::Options options;
  options.threads = 1;
  const auto report =
      diagnose::diagnose({simulated_as(fmt::format("twin{}", GetParam()), *plant, *path, session)},
                         {}, *plant, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->verdict.kind, "nothing_left_out") << report->verdict.text;
}

/// What homing draws anew for each session is no step between them.
TEST(TwinOverTwoSessions, HasNothingLeftOut) {
  const auto plant =
      physics::load_plant(fs::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2.toml");
  ASSERT_TRUE(plant.ok());
  const auto path = trajectory::make_zigzag({});
  ASSERT_TRUE(path.ok());
  std::vector<record::Recording> sessions;
  for (std::uint64_t seed : {1, 2}) {
    simulation::SessionOptions session;
    session.seed = session.homing_seed = seed;
    sessions.push_back(simulated_as(fmt::format("session{}", seed), *plant, *path, session));
  }
  const auto report = diagnose::diagnose(sessions, {}, *plant, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->verdict.kind, "nothing_left_out") << report->verdict.text;
}

/// Over the whole travel the run-out of the drives shows, wherever homing has put their zeros.
TEST(TwinOnTheZigZag, HasNothingLeftOut) {
  const auto plant =
      physics::load_plant(fs::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2.toml");
  ASSERT_TRUE(plant.ok());
  const auto path = trajectory::make_zigzag({});
  ASSERT_TRUE(path.ok());
  simulation::SessionOptions session;
  session.seed = 5;
  session.homing_seed = 3;
  diagnose::Options options;
  options.threads = 1;
  const auto report =
      diagnose::diagnose({simulated_as("zigzag", *plant, *path, session)}, {}, *plant, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->verdict.kind, "nothing_left_out") << report->verdict.text;
}

/// The loaded runs of the paper: what single drives take for uneven friction or heavier links.
TEST(TwinUnderLoad, CarriesOneWeightThatAllItsJointsFeel) {
  auto plant = physics::load_plant(fs::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2.toml");
  ASSERT_TRUE(plant.ok());
  trajectory::RandomOptions motion;
  motion.duration_s = 120.0;
  const auto path = trajectory::make_random(motion);
  ASSERT_TRUE(path.ok());
  physics::Plant loaded = *plant;
  loaded.payload.mass_kg += 0.5;
  diagnose::Options options;
  options.threads = 1;
  const auto report =
      diagnose::diagnose({simulated_as("loaded", loaded, *path, {})}, {}, *plant, options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_EQ(report->effects.size(), 1U) << report->verdict.text;
  const diagnose::NamedEffect& weight = report->effects.front();
  EXPECT_LT(weight.held_out_after, 0.5 * weight.held_out_before);
  if (weight.id == "payload") {
    ASSERT_EQ(weight.parameters.front().name, "mass");
    EXPECT_NEAR(weight.parameters.front().value, 0.5, 0.06);
    EXPECT_NEAR(report->improved.payload.mass_kg, 0.5, 0.06);
    return;
  }
  // Both hang at the origin of link 3: they differ in what accelerates alone.
  EXPECT_EQ(weight.id, "gravity") << report->verdict.text;
  EXPECT_EQ(weight.joint, "insertion");
  EXPECT_EQ(weight.ambiguous_with, std::vector<std::string>{"payload"}) << report->verdict.text;
  EXPECT_NEAR(weight.parameters.front().value * plant->joints[2].link.mass_kg, 0.5, 0.06);
}

diagnose::NamedEffect found(const std::string& id, const std::string& joint,
                            const std::string& stage, const std::string& parameter, double value) {
  diagnose::NamedEffect effect;
  effect.id = id;
  effect.joint = joint;
  effect.stage = stage;
  effect.parameters = {{parameter, value, "1", {value, value}}};
  return effect;
}

/// One number that the reader refuses would cost the user the whole file.
TEST(ImprovedText, HasInCommentsWhatNoPlantMayHave) {
  const auto plant =
      physics::load_plant(fs::path(RAVENCAL_SOURCE_DIR) / "tools/plants/raven2_published.toml");
  ASSERT_TRUE(plant.ok());
  diagnose::Report report;
  report.improved = *plant;
  report.effects = {found("payload", "elbow", "drive", "mass", -0.3),
                    found("slip", "elbow", "transmission", "size\nmass_kg", 0.01)};
  for (diagnose::NamedEffect& e : report.effects) e.beyond_plants = true;
  report.effects.push_back(found("delay", "elbow", "sensor", "delay", 0.002));
  const std::string text = diagnose::improved_text(report);
  for (const diagnose::NamedEffect& e : report.effects) {
    const bool said = text.find("#   elbow (" + e.stage + "): " + e.id) != std::string::npos;
    EXPECT_EQ(said, e.beyond_plants) << text;
  }
  auto read = physics::parse_plant(text, plant->source);
  ASSERT_TRUE(read.ok()) << read.error().message;
  read->hash = plant->hash;
  EXPECT_EQ(*read, *plant);
}

INSTANTIATE_TEST_SUITE_P(Sessions, TwinAsItsPlant, ::testing::Values(1, 3, 5, 14));

INSTANTIATE_TEST_SUITE_P(
    Plants, Improved,
    ::testing::Values(Change{"shoulder_ratio", "shoulder", "ratio = 0.053", "ratio = 0.02"},
                      Change{"insertion_ratio", "insertion", "ratio = -0.0135", "ratio = -0.03"},
                      Change{"elbow_ratio", "elbow", "ratio = 0.056", "ratio = 0.02"},
                      Change{"elbow_stop", "elbow", "stop_encoder_rad = 2.2689280",
                             "stop_encoder_rad = 2.3998277",
                             "  [[joint.effect]]\n"
                             "  id = \"homing_offset\"\n"
                             "  deviation_rad = 0.0010                  # [TUNED]\n"}),
    [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
