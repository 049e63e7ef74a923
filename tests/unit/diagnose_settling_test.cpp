// SPDX-License-Identifier: Apache-2.0
//
// Rows that no law covers: those of a joint at rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "diagnose_generated.hpp"

namespace ravencal::diagnose {
namespace {

using record::Role;

const NamedEffect* find(const Report& report, const std::string& id) {
  for (const NamedEffect& e : report.effects)
    if (e.id == id && e.joint == "one") return &e;
  return nullptr;
}

/// A joint that rests half of the time; at rest its drive carries `share` of its friction.
record::Recording resting(double share) {
  record::Recording r;
  r.channels = {{"q", "rad", Role::kMotorPosition, "one"},
                {"q2", "rad", Role::kMotorPosition, "two"},
                {"tau", "N_m", Role::kDriveTorque, "one"}};
  constexpr Eigen::Index kRows = 12'000;
  r.samples.resize(kRows, 3);
  r.source = "resting";
  constexpr double kPi = 3.14159265358979;
  double q = 0.0;
  std::uint32_t noise = 7;
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t_s = 0.01 * static_cast<double>(i);
    const double phase = std::fmod(t_s, 8.0);
    const double side = phase < 4.0 ? 1.0 : -1.0;
    const double moving = std::fmod(phase, 4.0);
    const bool rests = moving >= 2.0;
    // Every pass has its own speed.
    const double speed = 0.1 + 0.03 * std::fmod(std::floor(t_s / 8.0) * 3.0, 7.0);
    const double v = rests ? 0.0 : side * speed * std::pow(std::sin(0.5 * kPi * moving), 2);
    const double a = rests ? 0.0 : side * speed * 0.5 * kPi * std::sin(kPi * moving);
    noise = noise * 1664525U + 1013904223U;
    const double n = (static_cast<double>(noise >> 8) / 16777216.0 - 0.5) * 0.1;
    r.t_ns.push_back(10'000'000LL * i);
    r.samples.row(i) << q, 0.1 * std::sin(t_s), 2.0 * a + (rests ? share : 1.0) * side + n;
    q += 0.01 * v;
  }
  return r;
}

TEST(Rest, DoesNotBendTheFriction) {
  for (const double share : {0.4, 1.0}) {
    const auto report = diagnosed(resting(share));
    const NamedEffect* friction = find(report, "coulomb_friction");
    ASSERT_NE(friction, nullptr) << report.verdict.text;
    EXPECT_NEAR(friction->parameters.front().value, 1.0, 0.1) << share;
  }
}

}  // namespace
}  // namespace ravencal::diagnose
