// SPDX-License-Identifier: Apache-2.0
//
// Robot models in a folder of their own, and the plants that they give.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "physics/plant.hpp"
#include "physics/rigid_bodies.hpp"

namespace ravencal::physics {

namespace fs = std::filesystem;
using Eigen::VectorXd;

class RobotTexts : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  [[nodiscard]] Plant plant_of(const std::string& text, const std::string& name = "robot.xml") {
    auto plant = load_plant(write(name, text));
    EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
    return plant.ok() ? std::move(plant).value() : Plant{};
  }
  [[nodiscard]] std::string refusal_of(const std::string& text,
                                       const std::string& name = "robot.xml") const {
    const auto plant = load_plant(write(name, text));
    return plant.ok() ? "none" : plant.error().message;
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("robot_texts_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

inline std::string notes_of(const Plant& plant) {
  return fmt::format("{}", fmt::join(plant.notes, "\n"));
}

inline std::vector<std::string> names_of(const Plant& plant) {
  std::vector<std::string> out;
  for (const Joint& joint : plant.joints) out.push_back(joint.name);
  return out;
}

using Names = std::vector<std::string>;

/// Efforts at several states: two plants with the same ones are one robot.
inline std::vector<VectorXd> efforts_of(const Plant& plant) {
  auto bodies = RigidBodies::create(plant);
  EXPECT_TRUE(bodies.ok()) << (bodies.ok() ? "" : bodies.error().message);
  std::vector<VectorXd> out;
  const auto count = static_cast<Eigen::Index>(plant.joints.size());
  for (int k = 0; bodies.ok() && k < 5; ++k) {
    const VectorXd q = VectorXd::LinSpaced(count, 0.4 * k, 1.0 - 0.3 * k);
    out.push_back(bodies->efforts(q, 0.7 * q.array().cos(), 2.0 * q.array().sin()));
  }
  return out;
}

inline void expect_same_robot(const Plant& one, const Plant& other) {
  EXPECT_EQ(names_of(one), names_of(other));
  const std::vector<VectorXd> a = efforts_of(one), b = efforts_of(other);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k].size(), b[k].size());
    EXPECT_GT(a[k].norm(), 1e-3);
    EXPECT_LT((a[k] - b[k]).norm(), 1e-9 * (1.0 + a[k].norm())) << k;
  }
}

inline constexpr const char* kLink =
    "<inertial pos=\"0.1 0.02 0\" mass=\"1.5\" diaginertia=\"0.02 0.03 0.04\"/>";

}  // namespace ravencal::physics
