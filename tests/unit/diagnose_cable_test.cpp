// SPDX-License-Identifier: Apache-2.0
//
// The transmission's names: constants against loads, and the cable's effects together.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/diagnose.hpp"
#include "diagnose_arm.hpp"
#include "physics/cable_replay.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using generator::ArmScene;
using generator::ArmTruth;

diagnose::Report run(const ArmTruth& truth, const ArmScene& scene, const std::string& logger = {},
                     const std::string& concealed = {}) {
  const auto plant =
      physics::parse_plant(logger + generator::arm_plant(concealed, scene.mount_rad), "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  diagnose::Options options;
  options.threads = 1;
  auto report =
      diagnose::diagnose({generator::record_arm(truth, scene)}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

/// Names of what parts the two encoders, sorted.
std::vector<std::string> transmission_names(const diagnose::Report& report) {
  std::vector<std::string> names;
  for (const auto& e : report.effects)
    if (e.stage == "transmission" || e.stage == "sensor") names.push_back(e.id);
  std::sort(names.begin(), names.end());
  return names;
}

using Names = std::vector<std::string>;

bool says(const diagnose::NamedEffect& e, const std::string& id) {
  return e.id == id ||
         std::find(e.ambiguous_with.begin(), e.ambiguous_with.end(), id) != e.ambiguous_with.end();
}

constexpr double kSideways = 1.2;  // the weight pulls the cable to one side over the whole range

TEST(Constant, IsNoOffsetWhereTheStretchWithinItsToleranceExplainsIt) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto report = run({.stiffness = 440.0}, {.seed = seed,
                                                   .duration_s = 200.0,
                                                   .rate_hz = 50.0,
                                                   .deviation = 0.03,
                                                   .mount_rad = kSideways});
    EXPECT_EQ(transmission_names(report), Names{}) << "seed " << seed << report.verdict.text;
  }
}

TEST(Constant, IsAnOffsetWhereNoLoadExplainsIt) {
  const auto report = run(
      {.offset_rad = 0.003},
      {.seed = 3, .duration_s = 200.0, .rate_hz = 50.0, .deviation = 0.03, .mount_rad = kSideways});
  EXPECT_EQ(transmission_names(report), Names{"homing_offset"}) << report.verdict.text;
}

TEST(Constant, OfFrictionLeftBehindTheCableIsNoSlip) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto report = run({}, {.seed = seed,
                                 .duration_s = 200.0,
                                 .rate_hz = 100.0,
                                 .rich = true,
                                 .deviation = 0.03,
                                 .rest_s = 15.0});
    EXPECT_EQ(transmission_names(report), Names{}) << "seed " << seed << report.verdict.text;
  }
}

TEST(Constant, IsNoOffsetWhereTheDriveFeelsALoadThatThePlantDoesNotKnow) {
  // 70 g on the tool: 0.24 N m, too little for a name, and 0.6 mrad of stretch to one side.
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto report = run({.payload_kg = 0.07}, {.seed = seed,
                                                   .duration_s = 200.0,
                                                   .rate_hz = 50.0,
                                                   .deviation = 0.03,
                                                   .mount_rad = kSideways});
    EXPECT_EQ(transmission_names(report), Names{}) << "seed " << seed << report.verdict.text;
  }
}

/// Two recordings, each with the constant of a homing of its own.
diagnose::Report run_twice_homed(double gap_half_rad) {
  const std::string homing = "\n[[joint.effect]]\nid = \"homing_offset\"\ndeviation_rad = 0.004\n";
  const auto plant = physics::parse_plant(generator::arm_plant() + homing, "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  std::vector<record::Recording> recordings;
  for (const double offset_rad : {0.004, -0.004}) {
    const std::uint64_t seed = offset_rad > 0.0 ? 1 : 2;
    recordings.push_back(
        generator::record_arm({.gap_half_rad = gap_half_rad, .offset_rad = offset_rad},
                              {.seed = seed, .duration_s = 120.0, .rate_hz = 50.0, .rich = true}));
  }
  diagnose::Options options;
  options.threads = 1;
  return diagnose::diagnose(recordings, {}, plant.value(), options).value();
}

TEST(Constant, OfEachHomingHidesNothingAndIsNothing) {
  const auto gap = run_twice_homed(0.0009);
  ASSERT_EQ(transmission_names(gap), Names{"backlash"}) << gap.verdict.text;
  EXPECT_NEAR(gap.effects.front().parameters.front().value, 0.0009, 0.00018);
  const auto clean = run_twice_homed(0.0);
  EXPECT_EQ(transmission_names(clean), Names{}) << clean.verdict.text;
}

/// Where the recordings do not show how a reading jumped, the two look alike.
TEST(Step, OfLostCountsOrOfASlipIsSaidToBeEither) {
  for (const double rate_hz : {25.0, 50.0, 100.0}) {
    const ArmScene scene{.seed = 7, .duration_s = 200.0, .rate_hz = rate_hz};
    const auto lost = run({.lost_rad = 0.004}, scene);
    ASSERT_EQ(lost.effects.size(), 1U) << lost.verdict.text;
    EXPECT_TRUE(says(lost.effects.front(), "lost_counts")) << rate_hz << lost.verdict.text;
    EXPECT_TRUE(says(lost.effects.front(), "slip")) << rate_hz << lost.verdict.text;
    const auto slip = run({.slip_rad = 0.004}, scene);
    ASSERT_EQ(slip.effects.size(), 1U) << slip.verdict.text;
    EXPECT_TRUE(says(slip.effects.front(), "slip")) << rate_hz << slip.verdict.text;
    EXPECT_TRUE(says(slip.effects.front(), "lost_counts")) << rate_hz << slip.verdict.text;
  }
}

TEST(Number, OutOfToleranceIsThatWherePhysicsExplainsNoMore) {
  // The weight's stretch is nearly a straight line over half a radian, as a wrong ratio is.
  const auto report = run({.stiffness = 290.0},
                          {.seed = 2, .duration_s = 200.0, .rate_hz = 50.0, .deviation = 0.02});
  ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
  EXPECT_EQ(report.effects.front().id, "compliance");
  EXPECT_TRUE(report.effects.front().out_of_tolerance);
}

TEST(Stream, LaterThanItsRecorderSaysIsADelay) {
  // 4 ms of transfer and at most half a period of 10 ms are the recorder's; 24 ms are not.
  const auto report = run({.delay_s = 0.024}, {.seed = 3, .duration_s = 200.0, .rate_hz = 50.0},
                          "[logger]\nrate_hz = 50\ntruth_period_s = 0.01\n"
                          "truth_latency_s = 0.004\ntruth_latency_deviation_s = 0.0015\n\n");
  ASSERT_EQ(transmission_names(report), Names{"delay"}) << report.verdict.text;
  EXPECT_FALSE(report.effects.front().out_of_tolerance);
  EXPECT_NEAR(report.effects.front().parameters.front().value, 0.024 - 0.0065, 0.004);
}

TEST(Cable, CreepUnderOneSidedLoadIsNoOffset) {
  const auto report =
      run({.creep = 0.004},
          {.seed = 5, .duration_s = 200.0, .rate_hz = 50.0, .rich = true, .mount_rad = kSideways});
  EXPECT_EQ(transmission_names(report), Names{"creep"}) << report.verdict.text;
}

TEST(Cable, ADriftOverTheWholeRecordingIsNoCreep) {
  // Creep under a load of one sign is a drift as well, but one that ends.
  const auto report =
      run({.drift_rad = 0.006},
          {.seed = 3, .duration_s = 160.0, .rate_hz = 50.0, .rich = true, .mount_rad = kSideways});
  EXPECT_EQ(transmission_names(report), Names{"thermal_drift"}) << report.verdict.text;
}

TEST(Cable, StrandsThatDoNotCloseTheirLoopsAreNoCreep) {
  const auto report = run({.strands_n_m = 1.2, .strands_yield_rad = 0.0012},
                          {.seed = 1, .duration_s = 200.0, .rate_hz = 50.0, .rich = true});
  EXPECT_EQ(transmission_names(report), Names{"hysteresis"}) << report.verdict.text;
}

TEST(Cable, AGapIsFittedWithThePlantsFrictionFree) {
  // At its limit the plant's friction stands in for part of the gap until the gap is known.
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const auto report = run({.gap_half_rad = 0.0009},
                            {.seed = seed, .duration_s = 160.0, .rate_hz = 50.0, .rich = true});
    ASSERT_EQ(transmission_names(report), Names{"backlash"}) << seed << report.verdict.text;
    EXPECT_NEAR(report.effects.front().parameters.front().value, 0.0009, 0.00018) << seed;
  }
}

TEST(Cable, ThatThePlantTakesForStiffStretchesBeforeItsRatioIsWrong) {
  // Slow motion: all load is weight, which over half a radian is nearly a straight line.
  const auto report =
      run({.stiffness = 300.0},
          {.seed = 6, .duration_s = 200.0, .rate_hz = 50.0, .deviation = 0.02}, {}, "compliance");
  EXPECT_EQ(transmission_names(report), Names{"compliance"}) << report.verdict.text;
}

TEST(Cable, ASlipIsSeenBesideStrandsThatHideIt) {
  const auto report =
      run({.strands_n_m = 1.4, .strands_yield_rad = 0.0012, .slip_rad = -0.004},
          {.seed = 8, .duration_s = 200.0, .rate_hz = 100.0, .rich = true, .deviation = 0.03});
  EXPECT_EQ(transmission_names(report), (Names{"hysteresis", "slip"})) << report.verdict.text;
}

TEST(Cable, ASmallSlipIsSeenThoughOtherEffectsBendToIt) {
  const auto report =
      run({.slip_rad = -0.0012}, {.seed = 8, .duration_s = 200.0, .rate_hz = 50.0, .rich = true});
  EXPECT_EQ(transmission_names(report), Names{"slip"}) << report.verdict.text;
}

TEST(Replay, ADampedCableLagsItsLoadByDampingOverStiffness) {
  // A load that steps at row 1: the stretch follows with that time constant (Kelvin and Voigt).
  const Index rows = 400;
  const Eigen::VectorXd t_s = Eigen::VectorXd::LinSpaced(rows, 0.0, 1e-3 * (rows - 1));
  const Eigen::VectorXd motor = Eigen::VectorXd::Zero(rows);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(rows);
  weight[0] = 0.0;
  std::vector<char> fresh(static_cast<std::size_t>(rows), 0);
  fresh.front() = 1;
  physics::CableNumbers cable;
  cable.compliance = 1.0 / 200.0;
  cable.damping = 10.0;  // 50 ms
  const auto moved = physics::replay_cable({t_s, motor, weight, {}, fresh, 1e-6}, cable);
  EXPECT_NEAR(moved.stretch[50] * 200.0, 1.0 - std::exp(-1.0), 0.02);
  EXPECT_NEAR(moved.stretch[rows - 1] * 200.0, 1.0, 2e-3);
  EXPECT_NEAR(moved.tension[50], 1.0, 1e-6);  // the load is balanced at once
}

TEST(Replay, OpenStrandsForgetInSmallReversalsWhatClosedOnesKeep) {
  // A load up to slip, then a hundred small swings about half of it.
  const Index swings = 100, rows = 40 + 20 * swings;
  Eigen::VectorXd t_s = Eigen::VectorXd::LinSpaced(rows, 0.0, 1e-2 * (rows - 1));
  Eigen::VectorXd weight(rows);
  for (Index i = 0; i < rows; ++i)
    weight[i] = i < 20 ? 0.05 * static_cast<double>(i)
                       : (i < 40 ? 1.0 - 0.025 * static_cast<double>(i - 20)
                                 : 0.5 + 0.05 * std::sin(0.314159265358979 * (i - 40)));
  const Eigen::VectorXd motor = Eigen::VectorXd::Zero(rows);
  std::vector<char> fresh(static_cast<std::size_t>(rows), 0);
  fresh.front() = 1;
  physics::CableNumbers cable;
  cable.compliance = 1.0 / 100.0;
  cable.strand_stiffness = 50.0;
  cable.strand_yield = 0.008;
  const auto wander = [&](double openness) {
    cable.strand_openness = openness;
    const auto moved = physics::replay_cable({t_s, motor, weight, {}, fresh, 1e-6}, cable);
    return std::abs(moved.stretch[rows - 1] - moved.stretch[rows - 1 - 20 * (swings - 1)]);
  };
  EXPECT_LT(wander(0.0), 1e-9);
  EXPECT_GT(wander(1.0), 1e-5);
}

}  // namespace
