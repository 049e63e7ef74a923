// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "diagnose/diagnose.hpp"
#include "diagnose_generator.hpp"

namespace ravencal::diagnose {

/// The report of one recording on the generator's plant, on one thread; `effects` as plant_text().
inline Report diagnosed(const record::Recording& recording, const std::string& effects = {}) {
  const auto plant = physics::parse_plant(generator::plant_text(effects), "generated.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  Options options;
  options.threads = 1;
  auto report = diagnose({recording}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return std::move(report).value();
}

}  // namespace ravencal::diagnose
