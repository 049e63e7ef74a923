// SPDX-License-Identifier: Apache-2.0
//
// The shipped plant, its twin at home, and a slow motion about home.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "core/catalogue.hpp"
#include "core/constants.hpp"
#include "physics/raven_twin.hpp"

namespace ravencal::physics {

inline constexpr double kDeg = core::kRadPerDeg;
inline const Eigen::Vector3d kHome(30.0 * kDeg, 90.0 * kDeg, 0.40);

inline Plant shipped_plant() {
  auto plant = load_plant(std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml");
  EXPECT_TRUE(plant.ok()) << plant.error().message;
  return std::move(plant).value();
}

inline RavenTwin homed_twin(const Plant& plant, std::uint64_t seed = 1,
                            std::uint64_t homing_seed = 1) {
  TwinOptions options;
  options.seed = seed;
  options.homing_seed = homing_seed;
  auto twin = RavenTwin::create(plant, options);
  EXPECT_TRUE(twin.ok()) << twin.error().message;
  twin->home();
  EXPECT_TRUE(twin->homed());
  return std::move(twin).value();
}

/// Desired joints of one control cycle, rad and m.
inline Eigen::Vector3d wave(int cycle) {
  const double t_s = 1e-3 * cycle;
  return kHome + Eigen::Vector3d(8 * kDeg * std::sin(0.4 * t_s), 10 * kDeg * std::sin(0.35 * t_s),
                                 0.01 * std::sin(0.5 * t_s));
}

inline double at(const RavenMessage& message, core::RavenField field, std::size_t element) {
  return message[core::catalogue_index(field, element)];
}

}  // namespace ravencal::physics
