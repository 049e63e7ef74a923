// SPDX-License-Identifier: Apache-2.0
//
// The digital twin as the controller and a plugin see it.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "physics/raven_twin.hpp"
#include "unit/twin_rig.hpp"

namespace ravencal::physics {
namespace {

using core::catalogue_index;
using core::RavenField;
using Eigen::Vector3d;

TEST(Twin, HomesToTheControllersHomePoseAndAwayFromTheTrueOne) {
  const Plant plant = shipped_plant();
  const RavenTwin twin = homed_twin(plant);
  const Vector3d error = twin.estimate_ji() - kHome;
  EXPECT_LT(std::abs(error[0]), 1.0 * kDeg);
  EXPECT_LT(std::abs(error[1]), 1.0 * kDeg);
  EXPECT_LT(std::abs(error[2]), 0.003);
  // The external encoder's zero differs from the controller's by -7.5 deg and +10.5 mm.
  const Vector3d raw = twin.truth().joints_ji - twin.estimate_ji();
  EXPECT_NEAR(raw[1] / kDeg, -7.5, 1.5);
  EXPECT_NEAR(raw[2] * 1e3, 10.5, 1.5);
}

TEST(Twin, EveryHomingSetsOtherOffsetsAndEqualSeedsSetEqualOnes) {
  const Plant plant = shipped_plant();
  const auto offset = [](RavenTwin& twin, std::size_t slot) {
    return at(twin.end_cycle((twin.begin_cycle(), kHome)), RavenField::kEncOffsets, slot);
  };
  RavenTwin first = homed_twin(plant, 1, 5);
  RavenTwin same_session = homed_twin(plant, 2, 5);
  RavenTwin other_session = homed_twin(plant, 1, 6);
  // jpos at the same true joint is what differs between homings; offsets also hold power-on counts.
  const auto raw = [](const RavenTwin& twin) -> Vector3d {
    return twin.truth().joints_ji - twin.estimate_ji();
  };
  EXPECT_GT((raw(first) - raw(other_session)).cwiseAbs().maxCoeff(), 1e-4);
  for (const std::size_t slot : {0UL, 1UL, 2UL, 3UL}) {
    EXPECT_EQ(offset(first, slot), offset(same_session, slot));
  }
  const double elbow_before = offset(first, 1);
  const double void_before = at(first.begin_cycle(), RavenField::kMpos, 3);
  first.home();
  EXPECT_NE(offset(first, 1), elbow_before);
  EXPECT_NE(at(first.begin_cycle(), RavenField::kMpos, 3), void_before);
  EXPECT_NE(void_before, 0.0);
}

TEST(Twin, ShiftsItsEncodersAtTheFirstRehomingOnly) {
  Plant plant = shipped_plant();
  EXPECT_GT(plant.robot.rehoming_shift_counts, 0.0);
  // Counts at the controller's home pose: motors are where they were within the seat of the stops.
  const auto counts_after = [&plant](int homings) {
    RavenTwin twin = homed_twin(plant, 1, 5);
    for (int i = 1; i < homings; ++i) twin.home();
    EXPECT_LT((twin.estimate_ji() - kHome).cwiseAbs().maxCoeff(), 1.0 * kDeg) << homings;
    const Vector3d raw_ji = twin.truth().joints_ji - twin.estimate_ji();
    EXPECT_NEAR(raw_ji[1] / kDeg, -7.5, 1.5) << homings;
    const RavenMessage message = twin.begin_cycle();
    std::vector<double> counts;
    for (std::size_t slot = 0; slot < core::kSlotCount; ++slot)
      counts.push_back(at(message, RavenField::kEncVals, slot));
    return counts;
  };
  const auto shifted = [](const std::vector<double>& a, const std::vector<double>& b) {
    int slots = 0;
    for (std::size_t slot = 0; slot < a.size(); ++slot)
      slots += std::abs(a[slot] - b[slot]) > 3000.0 ? 1 : 0;
    return slots;
  };
  const auto first = counts_after(1), second = counts_after(2), third = counts_after(3);
  EXPECT_EQ(shifted(first, second), 8);
  EXPECT_EQ(shifted(second, third), 0);
  plant.robot.rehoming_shift_counts = 0.0;
  const auto before = counts_after(1), after = counts_after(2);
  for (const std::size_t slot : {0UL, 1UL, 2UL, 3UL})
    EXPECT_LT(std::abs(before[slot] - after[slot]), 3000.0) << slot;
}

TEST(Twin, SaysThatHomingFailed) {
  Plant plant = shipped_plant();
  plant.joints[1].homing->dac_threshold_counts = 1e6;  // the command is clipped far below
  auto twin = RavenTwin::create(plant, 1);
  ASSERT_TRUE(twin.ok());
  EXPECT_FALSE(twin->homed());
  twin->home();
  EXPECT_FALSE(twin->homed());
  EXPECT_TRUE(homed_twin(shipped_plant()).homed());
}

TEST(Twin, ShowsTheHookThisCyclesPositionsAndTheLastCyclesTorques) {
  const Plant plant = shipped_plant();
  RavenTwin twin = homed_twin(plant);
  RavenMessage published = twin.end_cycle((twin.begin_cycle(), kHome));
  for (int i = 1; i < 2000; ++i) {
    const RavenMessage hook = twin.begin_cycle();
    for (std::size_t joint = 0; joint < 3; ++joint) {
      EXPECT_EQ(at(hook, RavenField::kDac, joint), 0.0);
      EXPECT_EQ(at(hook, RavenField::kTau, joint), at(published, RavenField::kTau, joint));
      EXPECT_EQ(at(hook, RavenField::kMposD, joint), at(published, RavenField::kMposD, joint));
      EXPECT_EQ(at(hook, RavenField::kPos, joint), at(published, RavenField::kPos, joint));
    }
    published = twin.end_cycle(wave(i));
    for (std::size_t joint = 0; joint < 3; ++joint) {
      EXPECT_EQ(at(hook, RavenField::kJpos, joint), at(published, RavenField::kJpos, joint));
      EXPECT_EQ(at(hook, RavenField::kEncVals, joint), at(published, RavenField::kEncVals, joint));
      EXPECT_EQ(at(hook, RavenField::kMvel, joint), at(published, RavenField::kMvel, joint));
    }
    EXPECT_EQ(at(hook, RavenField::kTime, 0), at(published, RavenField::kTime, 0));
  }
}

TEST(Twin, PublishesTheControllersArithmetic) {
  const Plant plant = shipped_plant();
  RavenTwin twin = homed_twin(plant);
  RavenMessage before = twin.end_cycle((twin.begin_cycle(), kHome));
  int moved = 0;
  int compared = 0;
  for (int i = 0; i < 3000; ++i) {
    twin.begin_cycle();
    const RavenMessage message = twin.end_cycle(wave(i));
    for (std::size_t joint = 0; joint < 3; ++joint) {
      const double tau = at(message, RavenField::kTau, joint);
      const double dac = at(message, RavenField::kDac, joint);
      // Published torque is float32: next to a whole number of counts it may fall on either side.
      const double exact = -3695.81 * tau;
      if (std::abs(exact - std::round(exact)) > 1e-3) {
        EXPECT_EQ(dac, std::trunc(exact));
        ++compared;
      }
      // 4000 counts per turn, sign -1: 0.09 deg per count, in float32.
      const double mpos = at(message, RavenField::kMpos, joint);
      EXPECT_NEAR(mpos,
                  0.09 * (-at(message, RavenField::kEncVals, joint) -
                          at(message, RavenField::kEncOffsets, joint)),
                  0.004);
      const double mvel = at(message, RavenField::kMvel, joint);
      EXPECT_NEAR(mvel, 1000.0 * (mpos - at(before, RavenField::kMpos, joint)), 8.0);
      EXPECT_NEAR(std::remainder(mvel, 90.0), 0.0, 1e-2);  // one count per ms
      EXPECT_NEAR(at(message, RavenField::kJvel, joint), mvel / plant.joints[joint].reduction,
                  1e-4);
      moved += mvel != 0.0;
    }
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_EQ(at(message, RavenField::kJacVel, k), at(message, RavenField::kJacF, k));
    }
    before = message;
  }
  EXPECT_GT(moved, 100);
  EXPECT_GT(compared, 8000);
  EXPECT_EQ(at(before, RavenField::kLastSeq, 0), 111.0);
  EXPECT_EQ(at(before, RavenField::kType, 0), 49.0);
}

TEST(Twin, PublishesTheInsertionInMetresTimesDegreesPerRadianAndTheToolThroughItsCoupling) {
  const Plant plant = shipped_plant();
  RavenTwin twin = homed_twin(plant);
  twin.begin_cycle();
  const RavenMessage message = twin.end_cycle(kHome);
  EXPECT_NEAR(at(message, RavenField::kJpos, 2), twin.estimate_ji()[2] / kDeg, 1e-5);
  EXPECT_NEAR(at(message, RavenField::kJpos, 7), 45.0, 0.1);
  // roll = (m_roll - m_insertion / GB_RATIO) / TR, gold arm.
  const double roll =
      (at(message, RavenField::kMpos, 4) - at(message, RavenField::kMpos, 2) / 2.908700441) /
      5.395176252;
  EXPECT_NEAR(at(message, RavenField::kJpos, 4), roll, 1e-2);
}

TEST(Twin, KeepsTheOtherArmParked) {
  const Plant plant = shipped_plant();
  RavenTwin twin = homed_twin(plant);
  twin.begin_cycle();
  const RavenMessage first = twin.end_cycle(kHome);
  RavenMessage last{};
  for (int i = 0; i < 500; ++i) {
    twin.begin_cycle();
    last = twin.end_cycle(wave(i));
  }
  for (std::size_t i = 0; i < core::kCatalogueSize; ++i) {
    if (!core::catalogue()[i].other_arm) continue;
    EXPECT_EQ(first[i], last[i]) << core::catalogue()[i].name;
  }
  EXPECT_EQ(last[catalogue_index(RavenField::kType, 0, true)], 22.0);
  EXPECT_NEAR(last[catalogue_index(RavenField::kJpos, 1, true)], 90.0, 0.1);
}

TEST(Twin, ClipsTheDacAtTheSafetyLevel) {
  const Plant plant = shipped_plant();
  RavenTwin twin = homed_twin(plant);
  double largest = 0.0;
  for (int i = 0; i < 100; ++i) {
    twin.begin_cycle();
    const RavenMessage message = twin.end_cycle(kHome + Vector3d(0.3, 0.0, 0.0));
    largest = std::max(largest, std::abs(at(message, RavenField::kDac, 0)));
  }
  EXPECT_EQ(largest, 2500.0);
}

std::uint64_t hash_of_run(const Plant& plant, std::uint64_t seed) {
  RavenTwin twin = homed_twin(plant, seed);
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (int i = 0; i < 2000; ++i) {
    twin.begin_cycle();
    for (const double value : twin.end_cycle(wave(i))) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3ULL;
    }
  }
  return hash;
}

TEST(Twin, RepeatsItselfForTheSameSeedOnly) {
  const Plant plant = shipped_plant();
  EXPECT_EQ(hash_of_run(plant, 3), hash_of_run(plant, 3));
  EXPECT_NE(hash_of_run(plant, 3), hash_of_run(plant, 4));
}

TEST(Twin, HalvingTheInnerStepDoesNotMoveTheTruth) {
  Plant plant = shipped_plant();
  const auto run = [](const Plant& p) {
    RavenTwin twin = homed_twin(p);
    std::vector<Vector3d> errors;
    for (int i = 0; i < 15'000; ++i) {
      twin.begin_cycle();
      twin.end_cycle(wave(i));
      if (i % 100 == 0) errors.push_back(twin.truth().joints_ji - twin.estimate_ji());
    }
    return errors;
  };
  const auto coarse = run(plant);
  plant.robot.inner_rate_hz *= 2.0;
  const auto fine = run(plant);
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < coarse.size(); ++i) sum += (coarse[i] - fine[i]).cwiseAbs2();
  const Vector3d rms = (sum / static_cast<double>(coarse.size())).cwiseSqrt();
  RecordProperty("rms_deg_deg_um", std::to_string(rms[0] / kDeg) + " " +
                                       std::to_string(rms[1] / kDeg) + " " +
                                       std::to_string(rms[2] * 1e6));
  // A tenth of what the best published calibration leaves: 0.03 deg, 0.03 deg, 0.015 mm.
  EXPECT_LT(rms[0], 0.03 * kDeg);
  EXPECT_LT(rms[1], 0.03 * kDeg);
  EXPECT_LT(rms[2], 0.015e-3);
}

TEST(Twin, SagsUnderThePayload) {
  Plant plant = shipped_plant();
  const auto error = [](const Plant& p) {
    RavenTwin twin = homed_twin(p);
    for (int i = 0; i < 4000; ++i) {
      twin.begin_cycle();
      twin.end_cycle(kHome + Vector3d(20 * kDeg, 0, 0) * std::min(1.0, i / 3000.0));
    }
    return Vector3d(twin.truth().joints_ji - twin.estimate_ji());
  };
  const Vector3d light = error(plant);
  plant.payload.mass_kg = 0.5;
  const Vector3d heavy = error(plant);
  EXPECT_GT((heavy - light).cwiseAbs()[0], 0.1 * kDeg);
}

TEST(Twin, QuantisesTheExternalEncoders) {
  const Plant plant = shipped_plant();
  const RavenTwin twin = homed_twin(plant);
  const Truth truth = twin.truth();
  EXPECT_NEAR(truth.encoder_ji[0], truth.joints_ji[0], 2 * std::numbers::pi / 80000);
  EXPECT_NEAR(truth.encoder_ji[2], truth.joints_ji[2], 5e-6);
  EXPECT_EQ(truth.encoder_ji[2], static_cast<double>(truth.encoder_counts[2]) * 5e-6);
}

TEST(Twin, RefusesAPlantThatIsNoRaven) {
  Plant plant = shipped_plant();
  plant.joints[0].name = "hip";
  const auto twin = RavenTwin::create(plant, 1);
  ASSERT_FALSE(twin.ok());
  EXPECT_NE(twin.error().message.find("hip"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::physics
