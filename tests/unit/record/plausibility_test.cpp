// SPDX-License-Identifier: Apache-2.0
//
// Set-up faults in recordings of an arm are found, and nothing is found without one.
#include "record/plausibility.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>

#include "record/load.hpp"

namespace ravencal::record {
namespace {

using Random = std::mt19937_64;

double drawn(Random& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

constexpr std::array<const char*, 3> kJoints = {"shoulder", "elbow", "insertion"};
/// Of each joint: what slack and stretch leave between motor and joint, and its gear ratio.
constexpr double kPlay_rad = 0.05, kGear = 17.6;

/// An arm of two turning joints and a sliding one in random motion. Each joint's truth follows its
/// estimate with play and stretch, some rows late.
class Arm {
 public:
  explicit Arm(Random& random) : random_(random) {
    const double rate_hz = drawn(random, 50.0, 400.0);
    const auto rows = static_cast<Eigen::Index>(drawn(random, 30.0, 60.0) * rate_hz);
    recording_.source = "folder/arm.db";
    recording_.samples.resize(rows, 15);
    for (Eigen::Index row = 0; row < rows; ++row)
      recording_.t_ns.push_back(std::llround(1e9 * static_cast<double>(row) / rate_hz));
    for (std::size_t joint = 0; joint < kJoints.size(); ++joint) add_joint(joint, rate_hz);
  }

  Recording& recording() { return recording_; }
  Eigen::Ref<Eigen::VectorXd> truth(std::size_t joint) { return values(joint, 1); }
  Eigen::Ref<Eigen::VectorXd> estimate(std::size_t joint) { return values(joint, 0); }
  Eigen::Ref<Eigen::VectorXd> velocity(std::size_t joint) { return values(joint, 3); }
  Eigen::Ref<Eigen::VectorXd> torque(std::size_t joint) { return values(joint, 4); }

  [[nodiscard]] std::vector<std::string> kinds_of(const std::string& channel) const {
    std::vector<std::string> kinds;
    for (const Implausibility& doubt : implausibilities(recording_))
      if (doubt.channel == channel) kinds.push_back(doubt.kind);
    return kinds;
  }
  [[nodiscard]] bool finds(const std::string& kind, const std::string& channel) const {
    const auto kinds = kinds_of(channel);
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  }

 private:
  Eigen::Ref<Eigen::VectorXd> values(std::size_t joint, Eigen::Index quantity) {
    return recording_.samples.col(5 * static_cast<Eigen::Index>(joint) + quantity);
  }

  void add_joint(std::size_t joint, double rate_hz) {
    const std::string name = kJoints[joint];
    const bool slides = joint == 2;
    const double size = slides ? 0.1 : 1.0;
    const char* unit = slides ? "m" : "rad";
    recording_.channels.push_back({"jpos." + name, unit, Role::kJointEstimate, name});
    recording_.channels.push_back({"truth." + name, unit, Role::kJointTruth, name});
    recording_.channels.push_back({"mpos." + name, "rad", Role::kMotorPosition, name});
    recording_.channels.push_back({"mvel." + name, "rad_per_s", Role::kMotorVelocity, name});
    recording_.channels.push_back({"tau." + name, "N_m", Role::kDriveTorque, name});
    std::array<double, 3> amplitude{}, frequency_hz{}, phase{};
    for (std::size_t i = 0; i < 3; ++i) {
      amplitude[i] = size * drawn(random_, 0.15, 0.5);
      frequency_hz[i] = drawn(random_, 0.05, 0.5);
      phase[i] = drawn(random_, 0.0, 2.0 * std::numbers::pi);
    }
    const double stretch = drawn(random_, 0.93, 1.07);
    const double play = size * kPlay_rad * drawn(random_, 0.1, 1.0);
    const double offset = size * drawn(random_, -0.15, 0.15);
    double behind = 0.0;
    std::normal_distribution<double> noise(0.0, 1e-4 * size);
    for (Eigen::Index row = 0; row < recording_.rows(); ++row) {
      double position = 0.0, speed = 0.0, acceleration = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const double w = 2.0 * std::numbers::pi * frequency_hz[i];
        const double angle = w * static_cast<double>(row) / rate_hz + phase[i];
        position += amplitude[i] * std::sin(angle);
        speed += amplitude[i] * w * std::cos(angle);
        acceleration -= amplitude[i] * w * w * std::sin(angle);
      }
      behind = row == 0 ? position : std::clamp(behind, position - play, position + play);
      values(joint, 0)[row] = position;
      values(joint, 1)[row] = stretch * behind + offset + noise(random_);
      values(joint, 2)[row] = kGear * position / size;
      values(joint, 3)[row] = kGear * speed / size;
      values(joint, 4)[row] = (0.3 * (speed > 0.0 ? 1.0 : -1.0) + 0.1 * speed / size +
                               0.05 * acceleration / size + 0.2 * std::sin(position));
    }
  }

  Random& random_;
  Recording recording_;
};

constexpr int kDraws = 100;

/// Plants a fault in a joint of a hundred arms; it is found there, and in no other joint.
void expect_found(const std::string& kind, const std::string& prefix,
                  const std::function<void(Arm&, std::size_t, Random&)>& plant) {
  Random random(67);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm arm(random);
    const std::size_t joint = random() % kJoints.size();
    plant(arm, joint, random);
    EXPECT_TRUE(arm.finds(kind, prefix + kJoints[joint])) << draw << " " << kJoints[joint];
    for (const char* other : kJoints) {
      if (other == kJoints[joint]) continue;
      EXPECT_EQ(arm.kinds_of(prefix + other), std::vector<std::string>()) << draw << other;
    }
  }
}

TEST(Plausibility, FindsNothingInAnArmWithPlayStretchAndDelay) {
  Random random(66);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm arm(random);
    for (const Implausibility& doubt : implausibilities(arm.recording()))
      ADD_FAILURE() << draw << ": " << doubt.sentence;
  }
}

TEST(Plausibility, AGainIsAnErrorAndAScaleAWarning) {
  expect_found("gain", "truth.", [](Arm& arm, std::size_t joint, Random& random) {
    const double gain = random() % 2 == 0 ? drawn(random, 2.3, 6.0) : drawn(random, 0.1, 0.45);
    arm.truth(joint) *= gain;
    const auto warnings = plausibility_warnings({&arm.recording()});
    ASSERT_FALSE(warnings.ok()) << gain;
    EXPECT_NE(warnings.error().message.find("folder/arm.db"), std::string::npos);
    EXPECT_NE(warnings.error().message.find("plausible = false"), std::string::npos);
  });
  expect_found("gain", "truth.", [](Arm& arm, std::size_t joint, Random& random) {
    arm.truth(joint) = arm.estimate(joint) * (random() % 2 == 0 ? 1.15 : 0.85) +
                       0.1 * (arm.truth(joint) - arm.estimate(joint));
    const auto warnings = plausibility_warnings({&arm.recording()});
    ASSERT_TRUE(warnings.ok()) << warnings.error().message;
    ASSERT_EQ(warnings->size(), 1U);
    EXPECT_EQ(warnings->front().rfind("arm.db: ", 0), 0U) << warnings->front();
  });
}

TEST(Plausibility, WhatIsKnownToBeRightIsNoError) {
  Random random(5);
  Arm arm(random);
  arm.truth(1) *= 4.0;
  arm.recording().meta[std::string(kKnownImplausible)] = "truth.shoulder, truth.elbow";
  EXPECT_TRUE(plausibility_warnings({&arm.recording()}).ok());
  EXPECT_TRUE(arm.finds("gain", "truth.elbow"));
  arm.recording().meta[std::string(kKnownImplausible)] = "truth.elbow2";
  EXPECT_FALSE(plausibility_warnings({&arm.recording()}).ok());
}

TEST(Plausibility, FindsATurnedSign) {
  expect_found("sign", "truth.",
               [](Arm& arm, std::size_t joint, Random&) { arm.truth(joint) *= -1.0; });
}

TEST(Plausibility, FindsExchangedPlugs) {
  Random random(68);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm arm(random);
    const std::size_t one = random() % 3, other = (one + 1 + random() % 2) % 3;
    const Eigen::VectorXd kept = arm.truth(one);
    arm.truth(one) = arm.truth(other);
    arm.truth(other) = kept;
    for (const std::size_t joint : {one, other})
      EXPECT_EQ(arm.kinds_of("truth." + std::string(kJoints[joint])),
                std::vector<std::string>{"exchanged"})
          << draw;
    EXPECT_FALSE(plausibility_warnings({&arm.recording()}).ok());
  }
}

TEST(Plausibility, TakesAJointThatIsHeldAndDraggedAlongForPhysics) {
  Random random(71);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm arm(random);
    const std::size_t held = random() % 2, moving = 1 - held;
    // The servo yields by a twentieth of what the neighbour's coupling moves the joint.
    arm.truth(held) = drawn(random, 0.2, 0.6) * arm.truth(moving);
    arm.estimate(held) = 0.05 * arm.truth(held);
    EXPECT_TRUE(plausibility_warnings({&arm.recording()}).ok()) << draw;
    EXPECT_EQ(arm.kinds_of(std::string("truth.") + kJoints[held]), std::vector<std::string>());
    EXPECT_EQ(arm.kinds_of(std::string("truth.") + kJoints[moving]), std::vector<std::string>());
  }
}

TEST(Plausibility, TakesAJointThatMovesAndIsDraggedAlongForPhysics) {
  Random random(72);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm arm(random);
    const std::size_t dragged = random() % 2, moving = 1 - dragged;
    arm.truth(dragged) = 0.2 * arm.truth(dragged) + 0.9 * arm.truth(moving);
    const auto kinds = arm.kinds_of(std::string("truth.") + kJoints[dragged]);
    EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "exchanged"), 0) << draw;
  }
}

TEST(Plausibility, FindsAnotherHardStop) {
  expect_found("offset", "truth.", [](Arm& arm, std::size_t joint, Random& random) {
    const double travel = arm.estimate(joint).maxCoeff() - arm.estimate(joint).minCoeff();
    arm.truth(joint).array() += (random() % 2 == 0 ? 1.0 : -1.0) * drawn(random, 1.1, 2.0) * travel;
  });
}

TEST(Plausibility, FindsAFrozenEncoder) {
  expect_found("frozen", "truth.", [](Arm& arm, std::size_t joint, Random& random) {
    const Eigen::Index rows = arm.recording().rows();
    const auto from =
        static_cast<Eigen::Index>(drawn(random, 0.0, 0.5) * static_cast<double>(rows));
    arm.truth(joint).segment(from, rows / 2).setConstant(arm.truth(joint)[from]);
  });
}

TEST(Plausibility, FindsTurnsOfAPositionThatWraps) {
  Random random(69);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm arm(random);
    const std::size_t joint = random() % 2;
    for (const bool is_truth : {true, false}) {
      auto values = is_truth ? arm.truth(joint) : arm.estimate(joint);
      const double edge = values.mean() + drawn(random, -0.1, 0.1);
      for (double& value : values)
        if (value > edge) value -= 2.0 * std::numbers::pi;
    }
    EXPECT_TRUE(arm.finds("turn", std::string("truth.") + kJoints[joint])) << draw;
    EXPECT_TRUE(arm.finds("turn", std::string("jpos.") + kJoints[joint])) << draw;
  }
}

TEST(Plausibility, FindsCountsThatJump) {
  expect_found("jump", "truth.", [](Arm& arm, std::size_t joint, Random& random) {
    const Eigen::Index rows = arm.recording().rows();
    const auto from =
        static_cast<Eigen::Index>(drawn(random, 0.2, 0.8) * static_cast<double>(rows));
    arm.truth(joint).tail(rows - from).array() +=
        (joint == 2 ? 0.1 : 1.0) * drawn(random, 0.4, 1.0);
  });
}

TEST(Plausibility, FindsAVelocityOfAnotherUnitOrSign) {
  expect_found("velocity", "mvel.", [](Arm& arm, std::size_t joint, Random& random) {
    const std::array<double, 5> factors = {-1.0, 1e-3, 1e3, 180.0 / std::numbers::pi, 9.549};
    arm.velocity(joint) *= factors[random() % factors.size()];
  });
}

TEST(Plausibility, FindsAnEffortThatDrivesBackwards) {
  expect_found("effort", "tau.",
               [](Arm& arm, std::size_t joint, Random&) { arm.torque(joint) *= -1.0; });
}

TEST(Plausibility, TakesAControllerThatDampsForPhysics) {
  Random random(73);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm arm(random);
    const std::size_t joint = random() % kJoints.size();
    arm.torque(joint) = -0.001 * arm.velocity(joint);
    EXPECT_FALSE(arm.finds("effort", std::string("tau.") + kJoints[joint])) << draw;
  }
}

TEST(Plausibility, FindsStampsThatStandStillOrAreOfAnotherUnit) {
  Random random(70);
  for (int draw = 0; draw < kDraws; ++draw) {
    Arm rounded(random);
    for (std::int64_t& t_ns : rounded.recording().t_ns) t_ns -= t_ns % 100'000'000;
    EXPECT_TRUE(rounded.finds("stamps", "")) << draw;
    Arm scaled(random);
    for (std::int64_t& t_ns : scaled.recording().t_ns) t_ns /= 1'000'000;
    EXPECT_TRUE(scaled.finds("rate", "")) << draw;
  }
}

TEST(Plausibility, FindsNothingInThePublicRecordings) {
  const std::filesystem::path data = RAVENCAL_DATA_DIR;
  if (!std::filesystem::exists(data / "raven2_uiuc"))
    GTEST_SKIP() << "real data not found: " << data << "; set RAVENCAL_DATA_DIR";
  const std::pair<const char*, const char*> sets[] = {{"bam_xl330", ""},
                                                      {"davinci_tool4", "train"},
                                                      {"double_pendulum", "train"},
                                                      {"dvrk_berkeley", ""},
                                                      {"emps", "emps_train"},
                                                      {"raven2_uiuc", ""},
                                                      {"raven2_uw", ""},
                                                      {"so101", ""}};
  for (const auto& [set, prefix] : sets) {
    LoadOptions options;
    options.profile = RAVENCAL_SOURCE_DIR "/tools/profiles/" + std::string(set) + ".toml";
    for (const auto& file : std::filesystem::directory_iterator(data / set)) {
      const std::string name = file.path().filename().string();
      if (file.path().extension() != ".csv" || name.rfind(prefix, 0) != 0) continue;
      const auto recording = load_recording(file.path(), options);
      ASSERT_TRUE(recording.ok()) << recording.error().message;
      for (const Implausibility& doubt : implausibilities(*recording))
        ADD_FAILURE() << name << ": " << doubt.sentence;
    }
  }
}

}  // namespace
}  // namespace ravencal::record
