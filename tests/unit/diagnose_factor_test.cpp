// SPDX-License-Identifier: Apache-2.0
//
// Numbers of a drive that are all off by one factor: its torque constant.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "diagnose/channel/channel.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose_form.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kRows = 6000;
constexpr double kFactorStep_s = 0.01;

diagnose::Series drive() {
  diagnose::Series s;
  s.joint = "one";
  s.stage = diagnose::Stage::kDrive;
  s.unit = "N_m";
  s.t_s = VectorXd::LinSpaced(kRows, 0.0, kFactorStep_s * static_cast<double>(kRows - 1));
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
    fit.nominal->prediction = VectorXd::Zero(kRows);
    for (std::size_t n = 0; n < changes.size(); ++n) {
      const double rate = 0.7 + 0.9 * static_cast<double>(n);
      const VectorXd column = (rate * series.t_s.array() + static_cast<double>(n)).sin();
      fit.nominal->terms.push_back({"number", std::to_string(n), "N_m", 1.0, 0.1, column});
      fit.nominal->prediction += column;
      series.y += (1.0 + changes[n]) * column;
    }
    for (double& y : series.y) y += 0.05 * (static_cast<double>(engine() >> 11U) * 0x1.0p-53 - 0.5);
    fit.forms.push_back(generator::form_of("torque_constant", {}, *fit.nominal, {}));
    fit.model = diagnose::prepare_channel(series, *fit.nominal, fit.forms);
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

TEST(CommonFactor, IsNoneWhereNumbersDisagreeOrAreHardlyOffOrByFar) {
  for (const auto& changes :
       {std::array{0.10, -0.12, 0.09, -0.11, 0.12}, std::array{0.05, 0.04, 0.06, 0.05, 0.04},
        std::array{0.12, 0.0, 0.0, 0.02, -0.01}}) {
    Case some(changes);
    diagnose::adopt_common_factor(some.fit);
    EXPECT_TRUE(some.fit.model.chosen.empty()) << ::testing::PrintToString(changes);
  }
}

/// The only name for joint "one", on which no load acts, that has this much of its plant's dry
/// friction and whose recorded effort is `recorded` times what it gives.
diagnose::NamedEffect only_name(double friction, double recorded) {
  record::Recording recording =
      generator::make_recording({.coulomb_n_m = 0.5 * friction, .viscous_n_m_s = 4.0},
                                {.seed = 9, .duration_s = 240.0, .with_truth = false});
  recording.samples.col(2) *= recorded;
  const auto plant = physics::parse_plant(
      generator::plant_text(
          "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n_m = 0.5\n"
          "\n  [[joint.effect]]\n  id = \"viscous_friction\"\n  damping_n_m_s_per_rad = 4.0\n"),
      "test plant");
  diagnose::Options options;
  options.threads = 1;
  const auto report = diagnose::diagnose({recording}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok() && report->effects.size() == 1U)
      << (report.ok() ? report->verdict.text : report.error().message);
  return report.ok() && !report->effects.empty() ? report->effects.front()
                                                 : diagnose::NamedEffect{};
}

TEST(TorqueConstant, IsWrongWhereAllOfTheDrivesNumbersAreWrongAlike) {
  const diagnose::NamedEffect weak = only_name(1.0, 0.7);
  EXPECT_EQ(weak.id, "torque_constant");
  ASSERT_FALSE(weak.parameters.empty());
  EXPECT_NEAR(weak.parameters.front().value, 1.0 / 0.7 - 1.0, 0.1);
  // Odds against it aside, it weighs as any number that is off by as many tolerances.
  const auto form = generator::form_of("torque_constant");
  EXPECT_TRUE(form->ordinary(diagnose::Series{}));
  EXPECT_NEAR(form->off_by(VectorXd::Constant(1, 0.2)).value_or(0.0), 2.5, 1e-9);
  const diagnose::NamedEffect smooth = only_name(0.6, 1.0);
  EXPECT_EQ(smooth.id, "coulomb_friction");
  EXPECT_TRUE(smooth.out_of_tolerance);
  // One number off by two tolerances beside another at its limit is less likely than a gain.
  EXPECT_EQ(only_name(1.08, 1.15).id, "torque_constant");
}

}  // namespace
