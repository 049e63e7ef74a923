// SPDX-License-Identifier: Apache-2.0
//
// What of a hidden effect nothing else can imitate, and that no case hides a robot that is stuck.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "prove/generator/beyond.hpp"
#include "prove/generator/case.hpp"

namespace {

using namespace ravencal::prove;
using nlohmann::json;

struct AxisTwins {
  NominalRobot nominal;
  ravencal::record::Recording with, without;
};

/// One axis with and without the effect, without noise, for a minute.
AxisTwins axis_twins(std::string_view id, double amplitude, MotionKind motion) {
  Random random(7, id);
  AxisTwins t;
  t.nominal = draw_axis(random);
  const auto figures = motion_figures(t.nominal, motion, 60.0, 4);
  const Subject s = draw_subject(*kind_of(id), t.nominal, figures, 60.0, random);
  Session base = exact_session(t.nominal);
  base.duration_s = 60.0;
  base.motion = motion;
  Session changed = base;
  apply(s, amplitude, changed);
  for (const auto& [session, to] : {std::pair{&changed, &t.with}, std::pair{&base, &t.without}}) {
    auto recording = run_session(*session, {4, 9}, {});
    EXPECT_TRUE(recording.ok());
    *to = std::move(recording).value();
  }
  return t;
}

double whole(const AxisTwins& t, bool position) {
  const Signals a = signals_of(t.with, t.nominal, 0), b = signals_of(t.without, t.nominal, 0);
  const Eigen::VectorXd d = position ? Eigen::VectorXd(a.truth - a.q - b.truth + b.q)
                                     : Eigen::VectorXd(a.effort - b.effort);
  return std::sqrt(d.squaredNorm() / static_cast<double>(d.size()));
}

TEST(ProveBeyond, AKnownEffectUnderAnotherNameIsImitated) {
  const AxisTwins t = axis_twins("gain_error", 0.02, MotionKind::kSlow);
  const auto imitation = best_imitation(t.with, t.without, t.nominal, 0, true, "another");
  ASSERT_TRUE(imitation.has_value());
  EXPECT_EQ(imitation->by, "gain_error");
  EXPECT_LT(imitation->left, 0.1 * whole(t, true));
}

TEST(ProveBeyond, AnEffectDoesNotImitateItself) {
  const AxisTwins t = axis_twins("gain_error", 0.02, MotionKind::kSlow);
  const auto own = best_imitation(t.with, t.without, t.nominal, 0, true, "gain_error");
  ASSERT_TRUE(own.has_value());
  EXPECT_NE(own->by, "gain_error");
  EXPECT_GT(own->left, 1e-4);
}

TEST(ProveBeyond, AHillInTheTransmissionIsNothingThatIsKnown) {
  const AxisTwins t = axis_twins("local_bump", 0.005, MotionKind::kSlow);
  const auto imitation = best_imitation(t.with, t.without, t.nominal, 0, true, "local_bump");
  ASSERT_TRUE(imitation.has_value());
  EXPECT_GT(imitation->left, 0.6 * whole(t, true));
}

TEST(ProveBeyond, AWeakerMotorIsWhatThePlantsParametersCanSay) {
  const AxisTwins t = axis_twins("torque_constant", 0.2, MotionKind::kSlow);
  const auto imitation = best_imitation(t.with, t.without, t.nominal, 0, false, "torque_constant");
  ASSERT_TRUE(imitation.has_value());
  EXPECT_LT(imitation->left, 0.15 * whole(t, false));
}

TEST(ProveBeyond, NothingIsSaidOfAChannelThatIsNotRecorded) {
  AxisTwins t = axis_twins("gain_error", 0.02, MotionKind::kSlow);
  for (auto* recording : {&t.with, &t.without}) {
    for (auto& channel : recording->channels)
      if (channel.role == ravencal::record::Role::kDriveTorque)
        channel.role = ravencal::record::Role::kFeature;
  }
  EXPECT_FALSE(best_imitation(t.with, t.without, t.nominal, 0, false, "").has_value());
}

TEST(ProveBeyond, ARobotThatWouldBeStuckGetsLessOfItsEffect) {
  CaseOptions options;
  options.seed = 3;
  options.duration_s = 20.0;
  options.held_out_s = 5.0;
  CaseDesign design = draw_case_with(*kind_of("coulomb_friction"), 6.0, 1, options);
  const double asked = design.subjects.front().amplitude = 40.0;
  const auto files = make_case(design, {});
  ASSERT_TRUE(files.ok());
  const double given = json::parse(files.value().manifest)["subjects"][0]["amplitude"];
  EXPECT_LT(given, 0.6 * asked);
  EXPECT_GT(given, 0.0);
}

TEST(ProveBeyond, AVanishingSaturationClipsNothing) {
  const AxisTwins t = axis_twins("saturation", 1e-4, MotionKind::kRich);
  EXPECT_EQ(whole(t, false), 0.0);
}

}  // namespace
