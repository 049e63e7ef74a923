// SPDX-License-Identifier: Apache-2.0
//
// The mix of sealed cases, and that a case is what its manifest says.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "physics/plant.hpp"
#include "prove/generator/case.hpp"
#include "prove/generator/subject.hpp"

namespace {

using namespace ravencal::prove;
using nlohmann::json;

CaseOptions quick(std::uint64_t seed = 3) {
  CaseOptions options;
  options.seed = seed;
  options.duration_s = 20.0;
  options.held_out_s = 5.0;
  return options;
}

TEST(ProveCases, KeepTheMixInEveryTwenty) {
  std::map<CaseKind, int> kinds;
  for (int n = 0; n < 60; ++n) ++kinds[draw_case(n, quick()).kind];
  EXPECT_EQ(kinds[CaseKind::kControl], 18);
  EXPECT_EQ(kinds[CaseKind::kSingle], 21);
  EXPECT_EQ(kinds[CaseKind::kPair], 9);
  EXPECT_EQ(kinds[CaseKind::kOutside], 6);
  EXPECT_EQ(kinds[CaseKind::kParameter], 6);
}

TEST(ProveCases, HideEveryKindOfTheVocabularyInTurn) {
  std::set<std::string_view> seen;
  int slow = 0, mute = 0, blind = 0, number = 0;
  for (; number < 100; ++number) {
    const CaseDesign design = draw_case(number, quick());
    if (design.kind == CaseKind::kSingle) seen.insert(design.subjects.front().kind->id);
    slow += design.base.motion == MotionKind::kSlow ? 1 : 0;
    mute += design.base.with_torque ? 0 : 1;
    blind += design.base.with_truth ? 0 : 1;
  }
  EXPECT_EQ(seen.size(), vocabulary_kinds().size());
  EXPECT_GT(slow, 25);
  EXPECT_GT(mute, 3);
  EXPECT_GT(blind, 3);
}

TEST(ProveCases, AreTheSameForTheSameSeedAndOthersForAnother) {
  const auto make = [](std::uint64_t seed) {
    const CaseOptions options = quick(seed);
    auto files = make_case(draw_case(2, options), {});
    EXPECT_TRUE(files.ok());
    return std::move(files).value();
  };
  const CaseFiles one = make(5), same = make(5), other = make(6);
  EXPECT_EQ(one.manifest, same.manifest);
  EXPECT_EQ(one.plant, same.plant);
  const auto bits = [](const CaseFiles& files) {
    // NaN is lost truth, equal to itself here.
    return files.recording.samples.unaryExpr([](double x) { return std::isnan(x) ? 1e9 : x; })
        .eval();
  };
  EXPECT_EQ(bits(one), bits(same));
  EXPECT_NE(one.manifest, other.manifest);
}

TEST(ProveCases, WritePlantsThatTheToolReads) {
  for (int n = 0; n < 40; ++n) {
    const CaseDesign design = draw_case(n, quick());
    const auto plant = ravencal::physics::parse_plant(plant_text(design.nominal), "case");
    ASSERT_TRUE(plant.ok()) << plant.error().message;
    EXPECT_EQ(plant.value().joints.size(), design.nominal.joints.size());
  }
}

TEST(ProveCases, DrawWhatCablesFollowAndHalfOfThePlantsSayIt) {
  int arms = 0, said = 0, cables = 0, over_links = 0;
  for (int number = 0; number < 100; ++number) {
    const CaseDesign design = draw_case(number, quick());
    if (design.nominal.joints.size() < 2) continue;
    ++arms;
    const auto plant = ravencal::physics::parse_plant(plant_text(design.nominal), "case");
    ASSERT_TRUE(plant.ok()) << plant.error().message;
    said += plant->joints[1].coupling_through ? 1 : 0;
    for (std::size_t j = 1; j < plant->joints.size(); ++j) {
      const bool link = session_of(design).robot.joints[j].follows_links;
      ++cables;
      over_links += link ? 1 : 0;
      EXPECT_EQ(plant->joints[j].coupling_through.has_value(), design.nominal.says_ways);
      const auto truth =
          link ? ravencal::physics::Through::kLink : ravencal::physics::Through::kDrive;
      EXPECT_EQ(plant->joints[j].coupling_through.value_or(truth), truth);
    }
  }
  EXPECT_NEAR(said, arms / 2.0, arms / 4.0);
  EXPECT_NEAR(over_links, cables / 2.0, cables / 4.0);
}

TEST(ProveCases, StayWithinTolerancesUnlessThatIsWhatTheyHide) {
  for (int n = 0; n < 60; ++n) {
    const CaseDesign design = draw_case(n, quick());
    for (std::size_t j = 0; j < design.nominal.joints.size(); ++j) {
      const NominalJoint& plant = design.nominal.joints[j];
      const NominalJoint& truth = design.truth.joints[j];
      for (const auto& [a, b] :
           {std::pair{plant.stiffness, truth.stiffness}, std::pair{plant.coulomb, truth.coulomb},
            std::pair{plant.viscous, truth.viscous},
            std::pair{plant.joint_friction, truth.joint_friction},
            std::pair{plant.mass_kg, truth.mass_kg},
            std::pair{plant.stribeck_extra, truth.stribeck_extra}}) {
        const bool off = design.off && design.off->joint == j && std::abs(b - a) > kTolerance * a;
        if (off)
          EXPECT_GT(std::abs(b / a - 1.0), 2.0 * kTolerance);
        else
          EXPECT_LE(std::abs(b - a), kTolerance * a) << "case " << n;
      }
    }
  }
}

TEST(ProveCases, ADecoyLeavesThePlantWithoutWhatTheTruthDoesNotHaveEither) {
  const SubjectKind* coulomb = kind_of("coulomb_friction");
  const CaseDesign decoy = draw_case_with(*coulomb, 0.0, 4, quick());
  const CaseDesign hidden = draw_case_with(*coulomb, 5.0, 4, quick());
  const std::size_t j = decoy.subjects.front().joint;
  EXPECT_EQ(plant_text(decoy.nominal), plant_text(hidden.nominal));
  EXPECT_EQ(session_of(decoy).robot.joints[j].motor_friction.level, 0.0);
  EXPECT_GT(session_of(hidden).robot.joints[j].motor_friction.level, 0.1);
}

TEST(ProveCases, MeasureTheSizeThatWasAskedFor) {
  for (const char* id : {"gain_error", "homing_offset", "coulomb_friction", "backlash", "delay"}) {
    CaseOptions options = quick();
    options.duration_s = 60.0;
    CaseDesign design = draw_case_with(*kind_of(id), 6.0, 1, options);
    design.base.with_torque = design.base.with_truth = true;
    const auto files = make_case(design, {});
    ASSERT_TRUE(files.ok());
    const json manifest = json::parse(files.value().manifest);
    const double over = manifest["subjects"][0]["size_over_floor"];
    EXPECT_GT(over, 2.5) << id;
    EXPECT_LT(over, 15.0) << id;
  }
}

TEST(ProveCases, GiveTheToolNothingThatNamesTheCase) {
  const CaseOptions options = quick();
  std::set<std::string> metas;
  for (int n = 0; n < 8; ++n) {
    const CaseDesign design = draw_case(n, options);
    const auto files = make_case(design, {});
    ASSERT_TRUE(files.ok());
    std::string meta;
    for (const auto& [key, value] : files.value().recording.meta) meta += key + "=" + value + ";";
    metas.insert(meta);
    EXPECT_TRUE(files.value().recording.events.empty());
    for (const SubjectKind& k : vocabulary_kinds()) EXPECT_EQ(meta.find(k.id), std::string::npos);
  }
  EXPECT_EQ(metas.size(), 1U);
}

TEST(ProveSession, ReadingsStampedAlikeDoNotStopTheTruth) {
  Random random(7, "stamps");
  const NominalRobot nominal = draw_axis(random);
  Session session = exact_session(nominal);
  session.duration_s = 30.0;
  session.truth_latency_s = 0.02;
  session.truth_latency_deviation_s = 0.02;  // of 10 ms between readings: many overtake
  const auto recording = run_session(session, {4, 9}, {});
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  const std::string& joint = nominal.joints[0].name;
  const Eigen::VectorXd truth =
      recording->samples.col(*recording->column(ravencal::record::Role::kJointTruth, joint));
  const Eigen::VectorXd estimate =
      recording->samples.col(*recording->column(ravencal::record::Role::kJointEstimate, joint));
  EXPECT_LT((truth - estimate).norm(), 0.05 * estimate.norm());
}

}  // namespace
