// SPDX-License-Identifier: Apache-2.0
//
// Another simulator as the baseline of diagnose: what is compared with it, what is refused, and
// what is said of it.
#include "diagnose_input_sample.hpp"

namespace {

using namespace ravencal;
using namespace ravencal::input_sample;

core::Result<Tracks> against(const std::vector<Recording>& real,
                             const std::vector<Recording>& simulated, const physics::Plant& plant,
                             std::optional<double> held_out_from_s = {}) {
  RAVENCAL_ASSIGN_OR_RETURN(Tracks tracks, tracks_of(real, plant, held_out_from_s));
  RAVENCAL_RETURN_IF_ERROR(
      diagnose::compare_with_simulation(simulated, real, {}, plant, held_out_from_s, tracks));
  return tracks;
}

/// What the given plant leaves of that channel of joint "one": recording minus simulation.
std::optional<VectorXd> left_of(const std::vector<diagnose::Track>& tracks,
                                const physics::Plant& plant, ChannelKind kind) {
  const Likelihood likelihood(plant, tracks);
  const auto left = likelihood.residuals(likelihood.base(), likelihood.outcome(likelihood.base()));
  for (std::size_t c = 0; c < left.size(); ++c) {
    const Channel& channel = likelihood.channels()[c];
    if (channel.joint == 0 && channel.kind == kind) return diagnose::used_rows(channel, left[c]);
  }
  return std::nullopt;
}

double rms_of(const VectorXd& x) {
  return std::sqrt(x.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, x.size())));
}

std::string notes_of(const Tracks& tracks) {
  return fmt::format("{}", fmt::join(tracks.notes, "\n"));
}

TEST(DiagnoseBaseline, ComparesEffortsWithTheSimulationWhateverThePlantSays) {
  const Recording real =
      named("real.db", {.with_truth = false}, {.coulomb_n_m = 0.5, .viscous_n_m_s = 2.0});
  const Recording inverse = named("inverse.db", {.noise = 0.0, .with_truth = false});
  const auto column = *real.column(Role::kDriveTorque, "one");
  std::string text = generator::plant_text() + kSensors;
  const auto left_by = [&](const physics::Plant& plant) {
    const auto tracks = against({real}, {inverse}, plant, 30.0);
    EXPECT_TRUE(tracks.ok()) << tracks.error().message;
    EXPECT_EQ(notes_of(*tracks), "");
    const diagnose::JointTrack& joint = tracks->held_out[0].joints[0];
    const VectorXd recorded = joint.effort + joint.effort_shift;
    EXPECT_LT((recorded - real.samples.col(column).tail(recorded.size())).cwiseAbs().maxCoeff(),
              1e-12);
    return *left_of(tracks->held_out, plant, ChannelKind::kDrive);
  };
  const VectorXd left = left_by(plant_of(text));
  const VectorXd apart = (real.samples - inverse.samples).col(column).tail(real.rows() / 2);
  EXPECT_NEAR(rms_of(left), rms_of(apart), 0.2 * rms_of(apart));
  for (std::size_t at = text.find("= 2.0\n"); at != std::string::npos; at = text.find("= 2.0\n"))
    text.replace(at, 5, "= 0.5");
  const VectorXd lighter = left_by(plant_of(text));
  ASSERT_EQ(lighter.size(), left.size());
  EXPECT_LT((lighter - left).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(DiagnoseBaseline, SaysTheEffortThatWasRecorded) {
  const Recording real = named("real.db", {.with_truth = false}, {.coulomb_n_m = 0.5});
  const auto tracks =
      against({real}, {named("inverse.db", {.noise = 0.0, .with_truth = false})}, two_joints());
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  const Likelihood shifted(two_joints(), tracks->training);
  auto plain = tracks_of({real}, two_joints());
  const Likelihood measured(two_joints(), std::move(plain->training));
  const VectorXd recorded = shifted.recorded(shifted.channels()[0], 0);
  EXPECT_LT((recorded - measured.channels()[0].measured[0]).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT((shifted.channels()[0].measured[0] - recorded).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(DiagnoseBaseline, DoesNotCompareTheEffortThatDroveTheSimulation) {
  const Recording real = named("real.db", {}, {.gap_half_rad = 0.01, .coulomb_n_m = 0.5});
  Recording forward = named("forward.db", {.noise = 0.0}, {.gain = 0.02});
  const auto torque = *real.column(Role::kDriveTorque, "one");
  forward.samples.col(torque) = real.samples.col(torque);
  forward.samples.col(0) *= 1.05;
  forward.samples.col(2) *= 1.05;
  const auto tracks = against({real}, {forward}, two_joints());
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  EXPECT_FALSE(left_of(tracks->training, two_joints(), ChannelKind::kDrive));
  EXPECT_TRUE(left_of(tracks->training, two_joints(), ChannelKind::kPosition))
      << "the motion is compared";
  expect_words(notes_of(*tracks),
               {"joint one (drive) is not compared: the simulation has the recorded effort",
                "inverse simulation",
                "joint one (transmission): the simulation has a motion of its own (its position "
                "differs by"});
}

/// Without a truth, what is left of such a simulation is how it follows what was asked of it.
TEST(DiagnoseBaseline, ComparesTheMotionOfWhatTheRecordedEffortDrove) {
  Recording real = named("real.db", {.with_truth = false});
  add_channel(real, {"one.desired", "rad", Role::kDesiredPosition, "one"}, real.samples.col(0));
  const Recording same_command = real;
  real.samples.col(0) = named("real.db", {}, {.gap_half_rad = 0.01}).samples.col(2);
  const auto tracks = against({real}, {same_command}, two_joints());
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  EXPECT_FALSE(left_of(tracks->training, two_joints(), ChannelKind::kDrive));
  const auto lag = left_of(tracks->training, two_joints(), ChannelKind::kPosition);
  ASSERT_TRUE(lag) << notes_of(*tracks);
  EXPECT_NEAR(rms_of(*lag), 0.01, 0.002);
  EXPECT_TRUE(tracks->training[0].joints[0].tracking);
  expect_words(notes_of(*tracks), {"joint one (drive) is not compared",
                                   "joint one (tracking): the simulation has a motion of its own"});
}

TEST(DiagnoseBaseline, RefusesWhereNothingIsLeftToCompare) {
  const Recording real = named("real.db", {.with_truth = false});
  const auto refusal = [&](std::vector<Recording> simulated) {
    diagnose::Options options;
    options.simulated = std::move(simulated);
    const auto refused = diagnose::diagnose({real}, {}, two_joints(), options);
    EXPECT_FALSE(refused.ok());
    return refused.ok() ? core::Error{} : refused.error();
  };
  const core::Error copied = refusal({real});
  EXPECT_EQ(copied.code, core::ErrorCode::kData);
  expect_words(copied.message, {"nothing to compare", "recorded effort"});
  expect_words(refusal({named("forward.db", {.seed = 9, .with_truth = false})}).message,
               {"moves too differently to be compared row by row: its speed differs by", "deg/s",
                "% of the variance, and 50 % is the most"});
  const core::Error two = refusal({real, real});
  EXPECT_EQ(two.code, core::ErrorCode::kUsage);
  expect_words(two.message, {"--simulated: 2 files for 1 recordings"});
}

TEST(DiagnoseBaseline, RefusesAnotherCommand) {
  const auto commanded = [](const std::string& name, double times) {
    Recording r = named(name, {.with_truth = false});
    add_channel(r, {"one.desired", "rad", Role::kDesiredPosition, "one"}, times * r.samples.col(0));
    return r;
  };
  const auto refused = against({commanded("a.db", 1.0)}, {commanded("b.db", 1.2)}, two_joints());
  ASSERT_FALSE(refused.ok());
  expect_words(refused.error().message, {"b.db: is of another motion than folder/a.db: the desired "
                                         "position of joint one differs by",
                                         "deg RMS, and "});
}

TEST(DiagnoseBaseline, SaysWhatItTookForGrantedOfTheTimes) {
  const Recording real = named("real.db", {.with_torque = false}, {.offset_rad = 0.05});
  Recording late = named("late.csv", {.noise = 0.0, .with_torque = false});
  late.meta["assumed_row_period_s"] = "0.01";
  for (std::int64_t& t : late.t_ns) t += 3'600'000'000'000;
  late.t_ns.resize(1400);
  late.samples.conservativeResize(1400, Eigen::NoChange);
  const auto tracks = against({real}, {late}, two_joints());
  ASSERT_TRUE(tracks.ok()) << tracks.error().message;
  expect_words(notes_of(*tracks), {"late.csv has no time in each row",
                                   "the times of late.csv and real.db nowhere overlap",
                                   "late.csv covers 1400 of 1500 rows"});
  const auto left = left_of(tracks->training, two_joints(), ChannelKind::kPosition);
  ASSERT_TRUE(left);
  EXPECT_NEAR(left->mean(), 0.05, 1e-3);
}

TEST(DiagnoseBaseline, NamesWhatTheSimulationLacksWithNotesBesideIt) {
  diagnose::Options options;
  options.held_out_from_s = 200.0;
  options.simulated = {make_recording({}, {.noise = 0.0, .with_truth = false})};
  options.simulated.front().meta["dropped_rows"] = "7";
  const Recording real = make_recording({.viscous_n_m_s = 8.0}, {.with_truth = false});
  const auto explained = diagnose::diagnose({real}, {}, two_joints(), options);
  ASSERT_TRUE(explained.ok()) << explained.error().message;
  ASSERT_EQ(explained->effects.size(), 1U);
  EXPECT_EQ(explained->effects[0].id, "viscous_friction");
  ASSERT_EQ(explained->notes.size(), 1U);
  expect_words(explained->notes[0], {"7 rows of generated"});
}

}  // namespace
