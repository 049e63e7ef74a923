// SPDX-License-Identifier: Apache-2.0
//
// Numbers of a drive that are all off by one factor.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/effects.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kRows = 6000;
constexpr double kStep_s = 0.01;

diagnose::Series drive() {
  diagnose::Series s;
  s.joint = "one";
  s.stage = diagnose::Stage::kDrive;
  s.unit = "N_m";
  s.t_s = VectorXd::LinSpaced(kRows, 0.0, kStep_s * static_cast<double>(kRows - 1));
  s.recording.assign(kRows, 0);
  s.fresh.assign(kRows, 0);
  s.fresh.front() = 1;
  s.held_out.assign(kRows, 0);
  s.valid.assign(kRows, 1);
  s.motion.q = s.motion.v = s.motion.a = VectorXd::Zero(kRows);
  s.motion.half_width_s = 0.02;
  return s;
}

/// A drive with five numbers, good to a tenth each, that are off by `changes`.
struct Case {
  diagnose::Series series = drive();
  diagnose::ChannelFit fit;

  explicit Case(const std::array<double, 5>& changes) {
    std::mt19937_64 engine(7);
    series.y = VectorXd::Zero(kRows);
    fit.nominal.prediction = VectorXd::Zero(kRows);
    for (std::size_t n = 0; n < changes.size(); ++n) {
      const double rate = 0.7 + 0.9 * static_cast<double>(n);
      const VectorXd column = (rate * series.t_s.array() + static_cast<double>(n)).sin();
      fit.nominal.terms.push_back({"number", std::to_string(n), "N_m", 1.0, 0.1, column});
      fit.nominal.prediction += column;
      series.y += (1.0 + changes[n]) * column;
    }
    for (double& y : series.y) y += 0.05 * (static_cast<double>(engine() >> 11U) * 0x1.0p-53 - 0.5);
    fit.forms.push_back(diagnose::torque_constant(fit.nominal.prediction));
    fit.model = diagnose::prepare_channel(series, fit.nominal, fit.forms);
  }
};

TEST(CommonFactor, OfAllNumbersIsTheTorqueConstant) {
  Case all({0.10, 0.12, 0.09, 0.11, 0.12});
  diagnose::adopt_common_factor(all.fit);
  ASSERT_EQ(all.fit.model.chosen.size(), 1U);
  EXPECT_TRUE(all.fit.model.chosen.front().by_numbers);
  const double b = joint_fit(all.fit.model).tail(1)[0];
  const double ratio = all.fit.forms.front()->parameters({}, {}, VectorXd::Constant(1, b))[0].value;
  EXPECT_NEAR(ratio, 1.0 / 1.108 - 1.0, 0.02);
}

TEST(CommonFactor, IsNoneWhereNumbersDisagreeOrAreHardlyOff) {
  for (const auto& changes :
       {std::array{0.10, -0.12, 0.09, -0.11, 0.12}, std::array{0.05, 0.04, 0.06, 0.05, 0.04},
        std::array{0.12, 0.0, 0.0, 0.02, -0.01}}) {
    Case some(changes);
    diagnose::adopt_common_factor(some.fit);
    EXPECT_TRUE(some.fit.model.chosen.empty()) << ::testing::PrintToString(changes);
  }
}

}  // namespace
