// SPDX-License-Identifier: Apache-2.0
//
// The free run's fit of a drive, and which numbers are known together only.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "diagnose/findings/combinations.hpp"
#include "diagnose/free_run/fit.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;

/// A drive that obeys physics::step_drive under a swept effort, and its series.
diagnose::Series drive_series(const physics::DriveNumbers<double>& truth) {
  constexpr Index kRows = 20000;
  diagnose::Series s;
  s.joint = "one";
  s.stage = diagnose::Stage::kDrive;
  s.unit = "N_m";
  s.t_s.resize(kRows);
  s.recorded.resize(kRows);
  s.motion.q.resize(kRows);
  s.motion.v.resize(kRows);
  physics::DriveState<double> state;
  for (Index i = 0; i < kRows; ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    s.t_s[i] = t;
    s.recorded[i] = 3.0 * std::sin(2.1 * t) + 2.0 * std::sin(0.7 * t);
    s.motion.q[i] = state.position;
    s.motion.v[i] = state.velocity;
    const double next = 3.0 * std::sin(2.1 * (t + 1e-3)) + 2.0 * std::sin(0.7 * (t + 1e-3));
    physics::step_drive(truth, 0.5 * (s.recorded[i] + next), 0.0, 1e-3, state);
  }
  s.recording.assign(kRows, 0);
  s.fresh.assign(kRows, 0);
  s.fresh[0] = 1;
  s.held_out.assign(kRows, 0);
  s.valid.assign(kRows, 1);
  s.y = s.recorded;
  s.motion.noise = 1e-6;
  return s;
}

constexpr const char* kFriction =
    "\n[[joint.effect]]\nid = \"coulomb_friction\"\nlevel_n_m = 0.5\n"
    "\n[[joint.effect]]\nid = \"viscous_friction\"\ndamping_n_m_s_per_rad = 1.0\n";

TEST(FreeRunFit, FindsTheNumbersOfTheDriveThatMadeTheMotion) {
  physics::DriveNumbers<double> truth;
  truth.inertia = 2.0;
  truth.level = 0.8;
  truth.viscous = 1.4;
  truth.presliding = 1e-4;
  const diagnose::Series series = drive_series(truth);
  auto plant = physics::parse_plant(generator::plant_text(kFriction), "friction");
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  const diagnose::FreeRun run(series, *plant);
  const physics::DriveNumbers<double> start = run.numbers(*plant);
  const auto fit = diagnose::fit_drive(
      run, start,
      diagnose::drive_handles(start, start, plant->joints.front(), false,
                              {"coulomb_friction.level", "viscous_friction.damping"}),
      1);
  EXPECT_TRUE(fit.better());
  EXPECT_LT(fit.judged_after, 0.2 * fit.judged_before);
  EXPECT_NEAR(fit.numbers.level, 0.8, 0.04);
  EXPECT_NEAR(fit.numbers.viscous, 1.4, 0.07);
  // 95 % intervals: the truth lies within, and they are no wider than they need be.
  for (std::size_t h = 0; h < fit.handles.size(); ++h) {
    if (fit.handles[h].parameter != "damping") continue;
    const VectorXd draws = fit.draws.col(static_cast<Index>(h));
    const double spread = std::sqrt((draws.array() - draws.mean()).square().mean());
    EXPECT_LT(spread, 0.2);
  }
}

TEST(FreeRunFit, LeavesARightPlantAlone) {
  physics::DriveNumbers<double> truth;
  truth.inertia = 2.0;
  truth.level = 0.5;
  truth.viscous = 1.0;
  truth.presliding = 1e-3;
  const diagnose::Series series = drive_series(truth);
  const auto plant = physics::parse_plant(generator::plant_text(kFriction), "friction");
  const diagnose::FreeRun run(series, *plant);
  const auto fit = diagnose::fit_drive(
      run, truth, diagnose::drive_handles(truth, truth, plant->joints.front(), false, {}), 1);
  EXPECT_FALSE(fit.better());
  EXPECT_DOUBLE_EQ(fit.numbers.level, 0.5);
}

TEST(Combinations, AreFoundWhereOnlyAProductIsKnown) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd draws(400, 3);
  for (Index d = 0; d < draws.rows(); ++d) {
    const double apart = 0.5 * normal(engine);
    draws.row(d) << apart, -apart + 0.01 * normal(engine), 0.02 * normal(engine);
  }
  const auto found = diagnose::combinations_of(
      {{"compliance", "stiffness"}, {"backlash", "half_width"}, {"creep", "time"}}, draws);
  ASSERT_EQ(found.size(), 1U);
  ASSERT_EQ(found.front().parameters.size(), 2U);
  EXPECT_DOUBLE_EQ(found.front().parameters[0].power, found.front().parameters[1].power);
  EXPECT_NEAR(found.front().value, 1.0, 0.01);
  EXPECT_GT(found.front().parameters[0].relative_deviation, 0.3);
}

TEST(Combinations, AreNotFoundWhereEachParameterIsKnown) {
  std::mt19937_64 engine(4);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd draws(400, 2);
  for (Index d = 0; d < draws.rows(); ++d)
    draws.row(d) << 0.3 * normal(engine), 0.3 * normal(engine);
  EXPECT_TRUE(
      diagnose::combinations_of({{"compliance", "stiffness"}, {"creep", "time"}}, draws).empty());
}

}  // namespace
