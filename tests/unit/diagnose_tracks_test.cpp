// SPDX-License-Identifier: Apache-2.0
//
// What diagnose asks of its input, and what it says where it took something for granted.
#include "diagnose_input_sample.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::input_sample;

TEST(DiagnoseTracks, HoldsOutRowsThatExist) {
  for (const double from_s : {60.5, 1e9, std::numeric_limits<double>::quiet_NaN(), 0.0, -3.0}) {
    const auto refused =
        diagnose::diagnose({named("a.db")}, {}, two_joints(), {.held_out_from_s = from_s});
    ASSERT_FALSE(refused.ok()) << from_s;
    EXPECT_EQ(refused.error().code, core::ErrorCode::kUsage);
    expect_words(refused.error().message, {"--held-out-from", "a.db ends at 59.96 s"});
  }
  const auto tracks = tracks_of({named("a.db")}, two_joints(), 30.0, {named("b.db", {.seed = 2})});
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  ASSERT_EQ(tracks->held_out.size(), 2U);
  EXPECT_EQ(tracks->training[0].rows() + tracks->held_out[0].rows(), tracks->held_out[1].rows());
  EXPECT_EQ(tracks->held_out[0].recording, 0U);
  EXPECT_EQ(tracks->held_out[1].recording, 1U);
  EXPECT_EQ(notes_of({named("a.db")}, two_joints(), 30.0), "");
}

TEST(DiagnoseTracks, SaysWhichRecordingEndsBeforeTheHeldOutPart) {
  EXPECT_EQ(notes_of({named("brief.db"), make_recording({}, {.seed = 2, .duration_s = 100.0})},
                     two_joints(), 80.0),
            "brief.db ends at 59.96 s, before --held-out-from 80: all of it is fitted");
}

TEST(DiagnoseTracks, LeavesOutARecordingWithTooFewRowsAndRefusesNothingElse) {
  Recording brief = named("brief.db");
  brief.t_ns.resize(30);
  brief.samples.conservativeResize(30, Eigen::NoChange);
  const auto refused = diagnose::diagnose({brief}, {}, two_joints(), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
  expect_words(refused.error().message, {"brief.db: 30 samples are too few"});
  EXPECT_EQ(notes_of({brief, named("a.db")}, two_joints()),
            "brief.db has too few rows to be looked at");
}

TEST(DiagnoseTracks, SaysWhatTheTimesWereTakenFrom) {
  Recording recording = named("a.csv");
  recording.meta["assumed_row_period_s"] = "0.01";
  recording.meta["assumed_time_unit"] = "us";
  recording.meta["assumed_channels"] = "one.position";
  recording.meta["dropped_rows"] = "7";
  expect_words(
      notes_of({recording}, two_joints()),
      {"a.csv has no time in each row", "0.01 s apart", "the sample time was assumed: 10 ms",
       "row_period_s", "the unit of the time of a.csv was assumed: us", ": one.position",
       "7 rows of a.csv cannot be read"});
}

TEST(DiagnoseTracks, RefusesAUnitThatThePlantCannotTake) {
  Recording wrong = named("a.db");
  wrong.channels[2].unit = "m";
  const auto truth = diagnose::diagnose({wrong}, {}, two_joints(), {});
  ASSERT_FALSE(truth.ok());
  EXPECT_EQ(truth.error().code, core::ErrorCode::kData);
  expect_words(truth.error().message, {"a.db", "one.truth", "joint_truth of joint 'one'", "in m,",
                                       "takes rad", "plant.toml"});
  Recording input = named("a.db");
  input.channels[3].role = Role::kDriveInput;
  input.channels[3].unit = "V";
  const auto volts = diagnose::diagnose({input}, {}, two_joints(), {});
  ASSERT_FALSE(volts.ok());
  expect_words(volts.error().message, {"one.torque (drive_input", "in V", "N_m", "[joint.drive]"});
  const std::string drive = "\n  [joint.drive]\n  input = \"voltage_v\"\n  gain = 2.0\n";
  EXPECT_TRUE(tracks_of({input}, two_joints(drive)).ok());
}

TEST(DiagnoseTracks, SaysWhichRecordingHasNothingToSayOfAChannel) {
  EXPECT_EQ(notes_of({named("a.db")}, two_joints(), {}, {named("b.db", {.with_torque = false})}),
            "b.db says nothing of joint one (drive): it lacks drive_torque\n"
            "no held-out row shows joint one (drive), so that no figure stands for it");
}

TEST(DiagnoseTracks, PredictsWithoutASourceThatWasNotRecordedAndSaysSo) {
  const physics::Plant plant = two_joints(R"(
  [[joint.effect]]
  id = "compliance"
  from = "force"
  stretch_per_load_rad = 1e-4
)");
  Recording recording = named("a.db");
  expect_words(notes_of({recording}, plant),
               {"compliance of joint one follows 'force'", "recorded: one, two"});
  add_channel(recording, {"force", "N", Role::kLoad, ""},
              VectorXd::Constant(recording.rows(), 10.0));
  EXPECT_EQ(notes_of({recording}, plant), "");
}

TEST(DiagnoseTracks, ListsTheLoadsThatMayStretchCables) {
  physics::Plant plant = two_joints();
  plant.joints[0].external_load = physics::ExternalLoad{"tip", -2.0};
  Recording recording = named("a.db");
  const VectorXd values = VectorXd::Constant(recording.rows(), 1.0);
  add_channel(recording, {"tip", "N_m", Role::kLoad, "one"}, values);
  add_channel(recording, {"force", "N", Role::kLoad, "two"}, values);
  add_channel(recording, {"sensor", "N_m", Role::kFeature, ""}, values);
  add_channel(recording, {"warmth", "K", Role::kFeature, ""}, values);
  const auto tracks = tracks_of({recording}, plant);
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  const diagnose::Track& track = tracks->training.front();
  ASSERT_EQ(track.loads.size(), 2U) << "the load from outside counts once, as a load";
  EXPECT_EQ(track.loads[0].name, "force");
  EXPECT_EQ(track.loads[0].joint, "two");
  EXPECT_EQ(track.loads[1].name, "sensor");
  EXPECT_EQ(track.loads[1].unit, "N_m");
  for (const diagnose::RecordedLoad& load : track.loads)
    EXPECT_EQ(track.forced.load(load.name).size(), track.rows()) << load.name;
}

TEST(DiagnoseTracks, NamesTheLoadThatStretchesACable) {
  const auto loaded = [](std::uint64_t seed) {
    Recording r = make_recording({}, {.seed = seed, .with_torque = false});
    VectorXd force = VectorXd::LinSpaced(r.rows(), 0.0, 60.0 + static_cast<double>(seed));
    force = 10.0 * force.array().sin();
    add_channel(r, {"force", "N", Role::kLoad, "one"}, force);
    r.samples.col(2) -= 5e-4 * force;
    return r;
  };
  const auto explained = diagnose::diagnose({loaded(1)}, {loaded(2)}, two_joints(), {});
  ASSERT_TRUE(explained.ok()) << explained.error().message;
  ASSERT_EQ(explained->effects.size(), 1U);
  const diagnose::NamedEffect& effect = explained->effects[0];
  EXPECT_EQ(effect.id, "compliance");
  EXPECT_EQ(effect.from, "force");
  ASSERT_EQ(effect.parameters.size(), 1U);
  EXPECT_EQ(effect.parameters[0].unit, "rad_per_N");
  EXPECT_NEAR(effect.parameters[0].value, 5e-4, 1e-5);
}

TEST(DiagnoseTracks, TakesAMeasuredLoadFromOutsideAndRefusesARecordingWithoutIt) {
  physics::Plant plant = two_joints();
  plant.joints[0].external_load = physics::ExternalLoad{"tip", -2.0};
  Recording recording = named("a.db");
  const auto absent = diagnose::diagnose({recording}, {}, plant, {});
  ASSERT_FALSE(absent.ok());
  expect_words(absent.error().message, {"a.db", "'tip'", plant.joints[0].name, "plant.toml"});

  add_channel(recording, {"tip", "N_m", Role::kLoad, "one"},
              VectorXd::Constant(recording.rows(), 0.25));
  const auto effort_by = [&](const physics::Plant& p) {
    auto tracks = tracks_of({recording}, p);
    EXPECT_TRUE(tracks.ok()) << tracks.error().message;
    const Likelihood likelihood(p, std::move(tracks->training));
    return likelihood.outcome(likelihood.base()).predictions[0].effort[0];
  };
  const VectorXd difference = effort_by(plant) - effort_by(two_joints());
  EXPECT_NEAR(difference.minCoeff(), -0.5, 1e-12);
  EXPECT_NEAR(difference.maxCoeff(), -0.5, 1e-12);
}

TEST(DiagnoseTracks, ListsTheJointsThatWereRecorded) {
  Recording other = named("a.db");
  for (record::Channel& channel : other.channels) channel.joint += "_left";
  const auto refused = diagnose::diagnose({other}, {}, two_joints(), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
  expect_words(refused.error().message, {"one_left (drive_torque, joint_estimate, joint_truth)",
                                         "two_left (joint_estimate)", "ravencal info folder/a.db"});
}

TEST(DiagnoseTracks, ComparesAPositionWithTheCommandOnlyWhereNothingShowsMore) {
  const auto commanded = [](const std::string& name) {
    Recording r = named(name, {.with_truth = false, .with_torque = false});
    add_channel(r, {"one.desired", "rad", Role::kDesiredPosition, "one"}, r.samples.col(0));
    return r;
  };
  const auto alone = tracks_of({commanded("a.db")}, two_joints());
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  EXPECT_TRUE(alone->training[0].joints[0].tracking);
  EXPECT_EQ(alone->training[0].joints[1].truth.size(), 0) << "nothing to compare it with";
  const auto beside = tracks_of({named("b.db")}, two_joints(), {}, {commanded("a.db")});
  ASSERT_TRUE(beside.ok()) << beside.error().message;
  EXPECT_FALSE(beside->held_out[0].joints[0].tracking);
  EXPECT_EQ(beside->held_out[0].joints[0].truth.size(), 0);
}

TEST(DiagnoseTracks, DoesNotCompareATruthWithItself) {
  Recording truth_alone = named("a.db");
  truth_alone.channels[0].role = Role::kStatus;
  truth_alone.channels[3].role = Role::kStatus;
  const auto refused = tracks_of({truth_alone}, two_joints());
  ASSERT_FALSE(refused.ok());
  expect_words(refused.error().message, {"has two signals to compare"});
}

TEST(DiagnoseTracks, DerivesJointsFromMotorsByTheirCoupling) {
  physics::Plant plant = two_joints();
  plant.coupling[1][0] = 0.5;
  Recording r = named("a.db");
  r.channels[0].role = Role::kMotorPosition;  // "one" by its motor, "two" by an estimate
  const auto tracks = tracks_of({r}, plant);
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  const diagnose::Track& track = tracks->training.front();
  const VectorXd motor = r.samples.col(1) - 0.5 * r.samples.col(0);
  EXPECT_LT((track.forced.motors[1].q - motor).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(DiagnoseTracks, UsesNoRowWhoseFilterReachesALostValueOrAnotherEpisode) {
  Recording r = named("a.db");
  const auto truth = *r.column(Role::kJointTruth, "one");
  r.samples(400, truth) = std::numeric_limits<double>::quiet_NaN();
  r.events.push_back({r.t_ns[800], "episode", ""});
  for (std::size_t i = 1200; i < r.t_ns.size(); ++i) r.t_ns[i] += 20'000'000'000;
  // What the law below made of it.
  const auto torque = *r.column(Role::kDriveTorque, "one");
  add_channel(r, {"one.desired", "rad", Role::kDesiredPosition, "one"},
              r.samples.col(0) + 0.5 * r.samples.col(torque));
  r.samples(500, r.samples.cols() - 1) = std::numeric_limits<double>::quiet_NaN();
  const physics::Plant plant = two_joints(
      "\n  [joint.controller]\n  kp_n_m_per_rad = 2.0\n  kd_n_m_s_per_rad = 0.0\n  "
      "dac_limit_counts = 0.0\n");
  auto tracks = tracks_of({r}, plant);
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  const Likelihood likelihood(plant, std::move(tracks->training));
  const Eigen::Index reach = likelihood.tracks()[0].tent_rows;
  const auto left = likelihood.residuals(likelihood.base(), likelihood.outcome(likelihood.base()));
  EXPECT_TRUE(likelihood.has(0, ChannelKind::kLaw));
  for (std::size_t c = 0; c < likelihood.channels().size(); ++c) {
    const Channel& channel = likelihood.channels()[c];
    EXPECT_FALSE(channel.used[0].empty());
    EXPECT_TRUE(left[c][0].allFinite());
    const Eigen::Index lost = channel.kind == ChannelKind::kLaw ? 500 : 400;
    for (const Eigen::Index row : channel.used[0]) {
      EXPECT_TRUE(channel.kind == ChannelKind::kDrive || std::abs(row - lost) > reach) << row;
      for (const Eigen::Index start : {800, 1200})
        EXPECT_TRUE(row < start - reach || row >= start + 25) << row;
    }
  }
}

}  // namespace
