// SPDX-License-Identifier: Apache-2.0
//
// What the drive's channel can say: limits of the drive, tones, loads that leak in from another
// joint, and numbers of the plant against missing physics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <random>

#include "diagnose/diagnose.hpp"
#include "diagnose/effects/effects.hpp"
#include "diagnose/fit/spectral_line.hpp"
#include "diagnose_form.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using diagnose::Series;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double kStep_s = 0.01;

double gauss(std::mt19937_64& engine) {
  double sum = -6.0;
  for (int k = 0; k < 12; ++k) sum += static_cast<double>(engine() >> 11U) * 0x1.0p-53;
  return sum;
}

/// First-order coloured noise of deviation 1.
VectorXd coloured(Index count, double memory, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  VectorXd x(count);
  double state = 0.0;
  for (Index i = 0; i < count; ++i) {
    state = memory * state + std::sqrt(1.0 - memory * memory) * gauss(engine);
    x[i] = state;
  }
  return x;
}

VectorXd times(Index count) {
  return VectorXd::LinSpaced(count, 0.0, kStep_s * static_cast<double>(count - 1));
}

Series empty_series(Index rows, diagnose::Stage stage) {
  Series s;
  s.joint = "one";
  s.stage = stage;
  s.unit = stage == diagnose::Stage::kDrive ? "N_m" : "rad";
  s.t_s = times(rows);
  const auto count = static_cast<std::size_t>(rows);
  s.recording.assign(count, 0);
  s.fresh.assign(count, 0);
  s.fresh.front() = 1;
  s.held_out.assign(count, 0);
  s.valid.assign(count, 1);
  s.y = VectorXd::Zero(rows);
  s.motion.q = s.motion.v = s.motion.a = VectorXd::Zero(rows);
  s.motion.half_width_s = 0.02;
  return s;
}

double triangle(double t_s) {
  const double phase = std::fmod(t_s, 10.0);
  return 0.1 * (phase < 5.0 ? phase : 10.0 - phase);
}

struct Servoed {
  Series series;
  VectorXd needed;  ///< as a plant of friction and inertia alone says
};

/// To and fro, a dash first and then hardly slower than a drive at its limit can go.
double dashing(double t_s) {
  const double phase = std::fmod(t_s, 14.0);
  const double since = phase < 7.0 ? phase : phase - 7.0;
  const double way = 0.25 * std::min(since, 1.0) + 0.085 * std::max(since - 1.0, 0.0);
  return phase < 7.0 ? way : 0.76 - way;
}

/// A mass with dry friction under a PD servo, drive limited to `limit`, friction `extra` higher
/// between 0.2 and 0.3 rad.
Servoed servoed(double limit, double extra, double (*desired)(double) = triangle) {
  constexpr double kMass = 0.5, kFriction = 1.5, kViscous = 3.0;
  Servoed out;
  out.series = empty_series(6000, diagnose::Stage::kDrive);
  Series& s = out.series;
  s.servo = physics::ServoLaw{.position = 400.0, .rate = 10.0, .limit = 8.0};
  s.inertia = kMass;
  s.tracking_error = VectorXd::Zero(s.rows());
  out.needed = s.tracking_error;
  double q = 0.0, v = 0.0;
  for (Index i = 0; i < s.rows(); ++i) {
    double a = 0.0;
    for (int k = 0; k < 20; ++k) {
      const double h = kStep_s / 20.0;
      const double t_s = s.t_s[i] + h * k;
      // Every third sweep carries a load that the drive can hardly lift.
      const double load = std::fmod(t_s, 30.0) < 10.0 ? 1.0 : 0.0;
      double u = std::clamp(400.0 * (desired(t_s) - q) - 10.0 * v, -8.0, 8.0);
      if (limit > 0.0) u = std::clamp(u, -limit, limit);
      const double level = kFriction + load + (q > 0.2 && q < 0.3 ? extra : 0.0);
      a = (u - kViscous * v - level * std::tanh(v / 1e-3)) / kMass;
      v += h * a;
      q += h * v;
    }
    s.motion.q[i] = q;
    s.motion.v[i] = v;
    s.motion.a[i] = a;
    s.tracking_error[i] = desired(s.t_s[i] + kStep_s) - q;
    const double load = std::fmod(s.t_s[i], 30.0) < 10.0 ? 1.0 : 0.0;
    out.needed[i] = kMass * a + kViscous * v + (kFriction + load) * std::tanh(v / 1e-3);
  }
  return out;
}

TEST(Saturation, IsFoundWhereTheJointLagsAndNothingMoreIsDelivered) {
  const Servoed run = servoed(2.65, 0.0);
  const auto form = diagnose::saturation(run.series, run.needed);
  ASSERT_EQ(form->untestable(run.series), "");
  const auto grid = form->grid(run.series);
  EXPECT_LT(grid.front()[0], 2.65);
  EXPECT_GT(grid.back()[0], 2.65);
  const Eigen::MatrixXd beyond = form->columns(run.series, {2.65});
  EXPECT_GT(beyond.cwiseAbs().maxCoeff(), 1.0) << "the law asked for much more";
}

TEST(Saturation, IsFoundWhereTheJointOftenMovesAsFastAsItShould) {
  constexpr double kLimit = 2.77;
  const Servoed run = servoed(kLimit, 0.0, dashing);
  const auto form = diagnose::saturation(run.series, run.needed);
  ASSERT_EQ(form->untestable(run.series), "");
  EXPECT_LT(form->grid(run.series).front()[0], kLimit);
  EXPECT_GT(form->grid(run.series).back()[0], kLimit);
  const Servoed free = servoed(0.0, 0.0, dashing);
  EXPECT_NE(diagnose::saturation(free.series, free.needed)->untestable(free.series), "");
}

TEST(Saturation, IsFoundWhereTheJointStoodForSecondsBeforeItMoved) {
  // Friction and load of every third sweep are more than the drive can move.
  constexpr double kLimit = 2.3;
  const Servoed run = servoed(kLimit, 0.0);
  const auto form = diagnose::saturation(run.series, run.needed);
  ASSERT_EQ(form->untestable(run.series), "");
  EXPECT_LT(form->grid(run.series).front()[0], kLimit);
  EXPECT_GT(form->grid(run.series).back()[0], kLimit);
}

TEST(Saturation, LimitIsWhatTheDriveGaveWhateverShareOfTheLawIsMissing) {
  const Servoed run = servoed(2.65, 0.0);
  const auto form = diagnose::saturation(run.series, run.needed);
  ASSERT_EQ(form->untestable(run.series), "");
  // The law is at its own bound of 8 nearly wherever it asks for more: 1.1 x (8 - 3.14) = 8 - 2.65.
  const auto bounded = form->parameters(run.series, {3.14}, VectorXd::Constant(1, 1.1));
  EXPECT_NEAR(bounded.front().value, 2.65, 0.15);
  const auto whole = form->parameters(run.series, {2.65}, VectorXd::Ones(1));
  EXPECT_NEAR(whole.front().value, 2.65, 1e-9);
}

TEST(Saturation, IsNotFoundWhereTheServoFollows) {
  const Servoed run = servoed(0.0, 0.0);
  EXPECT_NE(diagnose::saturation(run.series, run.needed)->untestable(run.series), "");
}

TEST(Saturation, IsNotAPlaceWithMoreFrictionThatTheServoOvercomes) {
  const Servoed run = servoed(0.0, 2.0);
  EXPECT_NE(diagnose::saturation(run.series, run.needed)->untestable(run.series), "");
}

TEST(Saturation, NeedsAControllerWhoseLawIsKnown) {
  Servoed run = servoed(2.65, 0.0);
  run.series.servo.reset();
  EXPECT_NE(diagnose::saturation(run.series, run.needed)->untestable(run.series), "");
}

TEST(FlexibleMode, AddsItsMassToSlowMotionAndSwingsOnAfterAnEdge) {
  Series s = empty_series(1000, diagnose::Stage::kDrive);
  for (Index i = 0; i < s.rows(); ++i) {
    s.motion.v[i] = 0.2 * s.t_s[i];
    s.motion.q[i] = 0.1 * s.t_s[i] * s.t_s[i];
  }
  const auto form = generator::form_of("flexible_mode");
  EXPECT_NEAR(form->columns(s, {5.0})(999, 0), 0.2, 0.01) << "force per mass is the acceleration";
  for (Index i = 0; i < s.rows(); ++i) s.motion.v[i] = i < 500 ? 0.0 : 0.1;
  const VectorXd ringing = form->columns(s, {5.0}).col(0);
  EXPECT_EQ(ringing.head(500).cwiseAbs().maxCoeff(), 0.0);
  int crossings = 0;
  for (Index i = 502; i < 600; ++i) crossings += ringing[i] * ringing[i - 1] < 0.0 ? 1 : 0;
  EXPECT_NEAR(crossings, 10, 1) << "5 Hz over a second";
}

TEST(FlexibleMode, CannotBeSeenThroughALongFilterOrAtALowRate) {
  Series s = empty_series(1000, diagnose::Stage::kDrive);
  EXPECT_EQ(generator::form_of("flexible_mode")->untestable(s), "");
  s.motion.half_width_s = 0.64;
  EXPECT_NE(generator::form_of("flexible_mode")->untestable(s), "");
  s.motion.half_width_s = 0.02;
  s.t_s *= 10.0;
  EXPECT_NE(generator::form_of("flexible_mode")->untestable(s), "");
}

TEST(Quantisation, FollowsTheTeethBetweenTheStepsOfTheRecordedPosition) {
  constexpr double kCount = 0.01;
  Series s = empty_series(6000, diagnose::Stage::kTransmission);
  VectorXd error(s.rows());
  for (Index i = 0; i < s.rows(); ++i) {
    const double truth = triangle(s.t_s[i]);
    s.motion.q[i] = kCount * std::floor(truth / kCount);
    error[i] = truth - s.motion.q[i];
  }
  const auto form = generator::form_of("quantisation");
  ASSERT_EQ(form->untestable(s), "");
  const VectorXd z = form->columns(s, {}).col(0);
  const VectorXd y = error.array() - error.mean();
  const double b = z.dot(y) / z.squaredNorm();
  EXPECT_NEAR(b, 1.0, 0.1);
  EXPECT_LT((y - b * z).squaredNorm(), 0.1 * y.squaredNorm());
  EXPECT_EQ(form->inconsistency(s, {}, VectorXd::Constant(1, b)), "");
  EXPECT_NEAR(form->parameters(s, {}, VectorXd::Ones(1)).front().value, kCount, 1e-6);
}

TEST(Quantisation, IsNotTestableWithAFineOrAContinuousPosition) {
  Series s = empty_series(6000, diagnose::Stage::kTransmission);
  for (Index i = 0; i < s.rows(); ++i) s.motion.q[i] = 1e-4 * std::floor(triangle(s.t_s[i]) / 1e-4);
  EXPECT_NE(generator::form_of("quantisation")->untestable(s), "");
  std::mt19937_64 engine(3);
  for (Index i = 0; i < s.rows(); ++i) s.motion.q[i] = triangle(s.t_s[i]) + 0.01 * gauss(engine);
  EXPECT_NE(generator::form_of("quantisation")->untestable(s), "");
}

TEST(Gravity, BendsOnlyWhereTheJointTurnsFar) {
  // Over a few degrees sine and cosine of the position are a line and a parabola of any size.
  const auto bends = [](const Series& s) {
    const auto grid = generator::form_of("gravity")->grid(s);
    return std::any_of(grid.begin(), grid.end(),
                       [](const diagnose::Shape& shape) { return shape[0] == 1.0; });
  };
  Series s = empty_series(6000, diagnose::Stage::kDrive);
  for (Index i = 0; i < s.rows(); ++i) s.motion.q[i] = 0.6 + 0.05 * std::sin(s.t_s[i]);
  EXPECT_FALSE(bends(s));
  for (Index i = 0; i < s.rows(); ++i) s.motion.q[i] = 0.6 + 0.5 * std::sin(s.t_s[i]);
  EXPECT_TRUE(bends(s));
  s.prismatic = true;
  EXPECT_FALSE(bends(s));
}

TEST(SpectralLine, StandsOutOfColouredNoise) {
  const VectorXd t_s = times(20000);
  const VectorXd noise = 0.3 * coloured(20000, 0.98, 1);
  const VectorXd tone = 0.5 * (2.0 * 3.14159265 * 0.73 * t_s.array()).sin();
  const auto line = diagnose::find_line(t_s, noise + tone, coloured(20000, 0.999, 2), 0.002);
  ASSERT_TRUE(line.has_value());
  EXPECT_NEAR(line->hz, 0.73, 0.005);
  EXPECT_NEAR(line->rms, 0.5 / std::sqrt(2.0), 0.05);
}

TEST(SpectralLine, IsMeasuredExactlyAtUnevenTimes) {
  // One tone alone, on a frequency of the search: its power there is its amplitude's square, and a
  // spectrum that were off by more than digits would show in amplitude or place.
  const Index rows = 15000;
  std::mt19937_64 engine(7);
  VectorXd t_s(rows);
  double t = 0.0;
  for (Index i = 0; i < rows; ++i) {
    t_s[i] = t;
    t += i == rows / 3 ? 7.0 : 0.06 + 0.01 * std::abs(gauss(engine));  // no two rows are averaged
  }
  const double hz = 0.1 + 0.5 * 900.0 / t_s[rows - 1];
  const VectorXd tone = 0.02 * (2.0 * std::numbers::pi * hz * t_s.array()).sin();
  const auto line = diagnose::find_line(t_s, tone, coloured(rows, 0.999, 2), 0.002);
  ASSERT_TRUE(line.has_value());
  EXPECT_NEAR(line->hz, hz, 1e-9);
  // Power by its definition, at that frequency.
  const double mean = tone.mean();
  std::complex<double> sum = 0.0;
  for (Index i = 0; i < rows; ++i)
    sum += (tone[i] - mean) * std::polar(1.0, -2.0 * std::numbers::pi * hz * t_s[i]);
  EXPECT_NEAR(line->rms, std::sqrt(2.0) * std::abs(sum) / static_cast<double>(rows), 1e-11);
}

TEST(SpectralLine, IsNotSeenInNoiseOfAnyMemory) {
  const VectorXd t_s = times(12000);
  for (std::uint64_t seed = 10; seed < 22; ++seed) {
    const double memory = seed % 3 == 0 ? 0.0 : (seed % 3 == 1 ? 0.95 : 0.999);
    EXPECT_FALSE(
        diagnose::find_line(t_s, coloured(12000, memory, seed), coloured(12000, 0.99, 5), 0.002))
        << seed;
  }
}

TEST(SpectralLine, OfTheMotionItselfIsNone) {
  const VectorXd t_s = times(20000);
  const VectorXd tone = (2.0 * 3.14159265 * 0.5 * t_s.array()).sin();
  EXPECT_FALSE(diagnose::find_line(t_s, 0.2 * coloured(20000, 0.9, 3) + 0.4 * tone,
                                   0.05 * coloured(20000, 0.9, 4) + tone, 0.002));
}

TEST(SpectralLine, IsSeenThoughItShakesTheJoint) {
  const VectorXd t_s = times(20000);
  const VectorXd tone = (2.0 * 3.14159265 * 0.5 * t_s.array()).sin();
  const VectorXd motion = coloured(20000, 0.9, 4) + 0.4 * tone;  // stands out by itself
  EXPECT_TRUE(diagnose::find_line(t_s, motion, coloured(20000, 0.9, 5), 0.002));
  EXPECT_TRUE(diagnose::find_line(t_s, 0.2 * coloured(20000, 0.9, 3) + 0.4 * tone, motion, 0.002));
}

TEST(SmoothMotion, KeepsVelocitiesSharpWhereAccelerationsNeedALongWindow) {
  const Index rows = 6000;
  const VectorXd t_s = times(rows);
  VectorXd q(rows);
  std::mt19937_64 engine(4);
  for (Index i = 0; i < rows; ++i) q[i] = triangle(t_s[i]) + 2e-5 * gauss(engine);
  const std::vector<char> none(static_cast<std::size_t>(rows), 0);
  const auto motion = physics::smooth_motion(t_s, q, none, none, 2);
  EXPECT_EQ(motion.q, q);
  EXPECT_LT(motion.noise, 6e-5);
  double worst = 0.0;
  for (Index i = 100; i + 100 < rows; ++i) {
    const double phase = std::fmod(t_s[i], 5.0);
    if (phase < 0.25 || phase > 4.75) continue;
    const double truth = std::fmod(t_s[i], 10.0) < 5.0 ? 0.1 : -0.1;
    worst = std::max(worst, std::abs(motion.v[i] - truth));
  }
  EXPECT_LT(worst, 0.01);
}

TEST(ToleranceForm, IsNoNumberThatIsWrongByMoreThanThree) {
  const diagnose::NominalTerm term{"inertia_error",  "inertia", "kg_m2", 0.4, 0.1,
                                   VectorXd::Ones(4)};
  const auto form = diagnose::tolerance_form(term, 0);
  EXPECT_EQ(form->inconsistency({}, {}, VectorXd::Constant(1, 0.5)), "");
  EXPECT_NE(form->inconsistency({}, {}, VectorXd::Constant(1, 19.0)), "");
  EXPECT_NE(form->inconsistency({}, {}, VectorXd::Constant(1, -0.8)), "");
}

TEST(Payload, CannotBeLessThanNothing) {
  Series s = empty_series(10, diagnose::Stage::kDrive);
  s.removable_mass_kg = 0.23;
  const auto form = diagnose::payload();
  EXPECT_EQ(form->inconsistency(s, {}, VectorXd::Constant(1, -0.1)), "");
  EXPECT_NE(form->inconsistency(s, {}, VectorXd::Constant(1, -5.4)), "");
}

/// Joint "one" with dry friction that the plant knows, and something more in its effort.
diagnose::Report with_more(const std::function<double(double t_s, double two, double side)>& more) {
  record::Recording recording = generator::make_recording(
      {.coulomb_n_m = 0.5}, {.seed = 7, .duration_s = 240.0, .with_truth = false});
  double side = 1.0;
  for (Index i = 1; i < recording.samples.rows(); ++i) {
    const double t_s = static_cast<double>(recording.t_ns[static_cast<std::size_t>(i)]) * 1e-9;
    const double moved = recording.samples(i, 1) - recording.samples(i - 1, 1);
    if (std::abs(moved) > 1e-3) side = moved > 0.0 ? 1.0 : -1.0;
    recording.samples(i, 2) += more(t_s, recording.samples(i, 1), side);
  }
  const auto plant = physics::parse_plant(
      generator::plant_text(
          "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n_m = 0.5\n"),
      "test plant");
  EXPECT_TRUE(plant.ok());
  diagnose::Options options;
  options.threads = 1;
  auto report = diagnose::diagnose({recording}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

TEST(Unknown, IsAToneThatGoesThroughTheWholeRecording) {
  const auto report = with_more(
      [](double t_s, double, double) { return 0.8 * std::sin(2.0 * 3.14159265 * 0.9 * t_s); });
  EXPECT_TRUE(std::any_of(report.unexplained.begin(), report.unexplained.end(), [](const auto& u) {
    return !u.depends_on.empty() && u.depends_on.front() == "time, at 0.9 Hz";
  })) << report.verdict.text;
  for (const auto& e : report.effects) EXPECT_EQ(e.id, "unknown") << report.verdict.text;
}

TEST(Unknown, IsALoadThatLeaksInFromAnotherJointWithItsFriction) {
  const auto report = with_more(
      [](double, double two, double side) { return 0.6 * std::sin(3.0 * two) + 0.5 * side; });
  ASSERT_FALSE(report.unexplained.empty()) << report.verdict.text;
  EXPECT_EQ(report.unexplained.front().depends_on.front(), "position of two")
      << report.verdict.text;
}

}  // namespace
