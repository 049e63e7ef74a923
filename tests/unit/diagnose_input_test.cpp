// SPDX-License-Identifier: Apache-2.0
//
// What diagnose asks of its input, and what it says where it took something for granted.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "diagnose/diagnose.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using diagnose::Stage;
using generator::make_recording;
using record::Recording;
using record::Role;

constexpr double kLength_s = 60.0;

physics::Plant plant_of(const std::string& text) {
  auto plant = physics::parse_plant(text, "plant.toml");
  EXPECT_TRUE(plant.ok()) << plant.error().message;
  return *plant;
}
physics::Plant two_joints(const std::string& effects = {}) {
  return plant_of(generator::plant_text(effects));
}

Recording named(const std::string& name, generator::Scene scene = {},
                const generator::HiddenPhysics& hidden = {}) {
  scene.duration_s = kLength_s;
  Recording recording = make_recording(hidden, scene);
  recording.source = "folder/" + name;
  return recording;
}

core::Result<diagnose::SeriesSet> series_of(const std::vector<Recording>& training,
                                            const physics::Plant& plant,
                                            std::optional<double> held_out_from_s = {},
                                            const std::vector<Recording>& held_out = {}) {
  diagnose::SeriesOptions options;
  options.held_out_from_s = held_out_from_s;
  return diagnose::build_series(training, held_out, plant, options);
}

std::string notes_of(const diagnose::SeriesSet& set) {
  return fmt::format("{}", fmt::join(set.notes, "\n"));
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << "wanted: " << word << "\nin: " << text;
}

TEST(DiagnoseInput, HoldsOutRowsThatExist) {
  for (const double from_s : {60.5, 1e9, std::numeric_limits<double>::quiet_NaN(), 0.0, -3.0}) {
    const auto set = series_of({named("a.db")}, two_joints(), from_s);
    ASSERT_FALSE(set.ok()) << from_s;
    EXPECT_EQ(set.error().code, core::ErrorCode::kUsage);
    expect_words(set.error().message, {"--held-out-from", "a.db ends at 59.96 s"});
  }
  const auto set = series_of({named("a.db")}, two_joints(), 30.0);
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_TRUE(set->series.front().any_held_out());
  EXPECT_EQ(notes_of(*set), "");
}

TEST(DiagnoseInput, SaysWhichRecordingEndsBeforeTheHeldOutPart) {
  Recording brief = named("brief.db");
  const auto set =
      series_of({brief, make_recording({}, {.seed = 2, .duration_s = 100.0})}, two_joints(), 80.0);
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(notes_of(*set),
            "brief.db ends at 59.96 s, before --held-out-from 80: all of it is fitted");
}

TEST(DiagnoseInput, SaysWhatTheTimesWereTakenFrom) {
  Recording recording = named("a.csv");
  recording.meta["assumed_row_period_s"] = "0.01";
  recording.meta["dropped_rows"] = "7";
  const auto set = series_of({recording}, two_joints());
  ASSERT_TRUE(set.ok()) << set.error().message;
  expect_words(notes_of(*set), {"a.csv has no time in each row", "0.01 s apart", "row_period_s",
                                "7 rows of a.csv cannot be read"});
}

TEST(DiagnoseInput, RefusesAUnitThatThePlantCannotTake) {
  Recording wrong = named("a.db");
  wrong.channels[2].unit = "m";
  const auto truth = series_of({wrong}, two_joints());
  ASSERT_FALSE(truth.ok());
  EXPECT_EQ(truth.error().code, core::ErrorCode::kData);
  expect_words(truth.error().message, {"a.db", "one.truth", "joint_truth of joint 'one'", "in m,",
                                       "takes rad", "plant.toml"});
  Recording input = named("a.db");
  input.channels[3].role = Role::kDriveInput;
  input.channels[3].unit = "V";
  const auto volts = series_of({input}, two_joints());
  ASSERT_FALSE(volts.ok());
  expect_words(volts.error().message, {"one.torque (drive_input", "in V", "N_m", "[joint.drive]"});
  const std::string drive = "\n  [joint.drive]\n  input = \"voltage_v\"\n  gain = 2.0\n";
  EXPECT_TRUE(series_of({input}, two_joints(drive)).ok());
}

TEST(DiagnoseInput, SaysWhichRecordingHasNothingToSayOfAChannel) {
  const auto set =
      series_of({named("a.db")}, two_joints(), {}, {named("b.db", {.with_torque = false})});
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(notes_of(*set),
            "b.db says nothing of joint one (drive): it lacks drive_torque\n"
            "no held-out row shows joint one (drive), so that no figure stands for it");
}

TEST(DiagnoseInput, SaysWhichLoadOfThePlantWasNotRecorded) {
  const auto set = series_of({named("a.db")}, two_joints(R"(
  [[joint.effect]]
  id = "compliance"
  from = "force"
  stretch_per_load_rad = 1e-4
)"));
  ASSERT_TRUE(set.ok()) << set.error().message;
  expect_words(notes_of(*set), {"compliance of joint one follows 'force'", "recorded: one, two"});
}

TEST(DiagnoseInput, TakesAMeasuredLoadFromOutsideAndRefusesARecordingWithoutIt) {
  physics::Plant plant = two_joints();
  plant.joints[0].external_load = physics::ExternalLoad{"tip", -2.0};
  Recording recording = named("a.db");
  const auto absent = series_of({recording}, plant);
  ASSERT_FALSE(absent.ok());
  expect_words(absent.error().message, {"a.db", "'tip'", plant.joints[0].name, "plant.toml"});

  recording.channels.push_back({"tip", "N_m", Role::kLoad, plant.joints[0].name});
  recording.samples.conservativeResize(Eigen::NoChange, recording.samples.cols() + 1);
  recording.samples.col(recording.samples.cols() - 1).setConstant(0.25);
  const auto set = series_of({recording}, plant);
  ASSERT_TRUE(set.ok()) << set.error().message;
  const auto without = series_of({recording}, two_joints());
  ASSERT_TRUE(without.ok());
  bool seen = false;
  for (std::size_t s = 0; s < set->series.size(); ++s) {
    const diagnose::Series& series = set->series[s];
    if (series.joint != plant.joints[0].name || series.stage != Stage::kDrive) continue;
    seen = true;
    const Eigen::VectorXd& before = without->series[s].weight;
    ASSERT_EQ(series.weight.size(), series.rows());
    for (Eigen::Index i = 0; i < series.rows(); ++i)
      ASSERT_NEAR(series.weight[i] - (before.size() > 0 ? before[i] : 0.0), -0.5, 1e-12);
    EXPECT_TRUE(series.loads.empty()) << "the load counts once";
  }
  EXPECT_TRUE(seen);
}

TEST(DiagnoseInput, ListsTheJointsThatWereRecorded) {
  Recording other = named("a.db");
  for (record::Channel& channel : other.channels) channel.joint += "_left";
  const auto set = series_of({other}, two_joints());
  ASSERT_FALSE(set.ok());
  expect_words(set.error().message, {"one_left (drive_torque, joint_estimate, joint_truth)",
                                     "two_left (joint_estimate)", "ravencal info folder/a.db"});
}

// --simulated

core::Result<diagnose::Report> against(const std::vector<Recording>& real,
                                       std::vector<Recording> simulated,
                                       const physics::Plant& plant,
                                       std::optional<double> held_out_from_s = {}) {
  diagnose::Options options;
  options.threads = 1;
  options.simulated = std::move(simulated);
  options.series.held_out_from_s = held_out_from_s;
  return diagnose::diagnose(real, {}, plant, options);
}

const diagnose::HeldOut* figure(const diagnose::Report& report, const std::string& metric) {
  for (const diagnose::HeldOut& h : report.held_out)
    if (h.joint == "one" && h.metric == metric) return &h;
  return nullptr;
}

/// In percent of the recorded effort, over the rows from that time on.
double effort_apart(const Recording& real, const Recording& simulated, double from_s) {
  const auto column = *real.column(Role::kDriveTorque, "one");
  double apart = 0.0, whole = 0.0;
  for (Eigen::Index i = 0; i < real.rows(); ++i) {
    if (1e-9 * static_cast<double>(real.t_ns[static_cast<std::size_t>(i)]) < from_s) continue;
    apart += std::pow(real.samples(i, column) - simulated.samples(i, column), 2);
    whole += std::pow(real.samples(i, column), 2);
  }
  return 100.0 * std::sqrt(apart / whole);
}

TEST(DiagnoseSimulated, ComparesEffortsWithTheSimulationWhateverThePlantSays) {
  const Recording real =
      named("real.db", {.with_truth = false}, {.coulomb_n_m = 0.5, .viscous_n_m_s = 2.0});
  const Recording inverse = named("inverse.db", {.noise = 0.0, .with_truth = false});
  std::string text = generator::plant_text();
  const auto report = against({real}, {inverse}, plant_of(text), 30.0);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const diagnose::HeldOut* unfiltered = figure(*report, "effort_relative_error_unfiltered");
  const diagnose::HeldOut* filtered = figure(*report, "effort_relative_error");
  ASSERT_NE(unfiltered, nullptr);
  ASSERT_NE(filtered, nullptr);
  const double expected = effort_apart(real, inverse, 30.0);
  EXPECT_NEAR(unfiltered->before, expected, 0.02 * expected);
  EXPECT_LT(unfiltered->after, 0.5 * unfiltered->before);
  EXPECT_NEAR(filtered->before, expected, 0.2 * expected);
  EXPECT_EQ(report->verdict.text.find("motion of its own"), std::string::npos);
  for (std::size_t at = text.find("= 2.0\n"); at != std::string::npos; at = text.find("= 2.0\n"))
    text.replace(at, 5, "= 0.5");
  const auto lighter = against({real}, {inverse}, plant_of(text), 30.0);
  ASSERT_TRUE(lighter.ok()) << lighter.error().message;
  EXPECT_NEAR(figure(*lighter, "effort_relative_error")->before, filtered->before,
              1e-6 * filtered->before);
  EXPECT_NEAR(figure(*lighter, "effort_relative_error_unfiltered")->before, unfiltered->before,
              1e-6 * unfiltered->before);
  ASSERT_FALSE(lighter->plots.empty());
  const diagnose::Trace& trace = lighter->plots.front().traces.front();
  const auto row = static_cast<Eigen::Index>(std::lround(trace.t_s[5] * 25.0));
  EXPECT_NEAR(trace.measured[5], real.samples(row, *real.column(Role::kDriveTorque, "one")), 0.4);
}

TEST(DiagnoseSimulated, DoesNotCompareTheEffortThatDroveTheSimulation) {
  const Recording real = named("real.db", {}, {.gap_half_rad = 0.01, .coulomb_n_m = 0.5});
  Recording forward = named("forward.db", {.noise = 0.0}, {.gain = 0.02});
  const auto torque = *real.column(Role::kDriveTorque, "one");
  forward.samples.col(torque) = real.samples.col(torque);
  forward.samples.col(0) *= 1.05;
  forward.samples.col(2) *= 1.05;
  const auto report = against({real}, {forward}, two_joints());
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(figure(*report, "effort_relative_error"), nullptr);
  EXPECT_NE(figure(*report, "position_rmse"), nullptr) << "the motion is compared";
  expect_words(report->verdict.text,
               {"joint one (drive) is not compared: the simulation has the recorded effort",
                "inverse simulation",
                "joint one (transmission): the simulation has a motion of "
                "its own (its position differs by"});
}

/// Without a truth, what is left of such a simulation is how it follows what was asked of it.
TEST(DiagnoseSimulated, ComparesTheMotionOfWhatTheRecordedEffortDrove) {
  Recording real = named("real.db", {.with_truth = false});
  const auto columns = real.samples.cols();
  real.channels.push_back({"one.desired", "rad", Role::kDesiredPosition, "one"});
  real.samples.conservativeResize(Eigen::NoChange, columns + 1);
  real.samples.col(columns) = real.samples.col(0);
  const Recording same_command = real;
  real.samples.col(0) = named("real.db", {}, {.gap_half_rad = 0.01}).samples.col(2);
  const auto report = against({real}, {same_command}, two_joints());
  ASSERT_TRUE(report.ok()) << report.error().message;
  const diagnose::HeldOut* tracking = figure(*report, "tracking_rmse");
  ASSERT_NE(tracking, nullptr) << report->verdict.text;
  EXPECT_NEAR(tracking->before, 0.01, 0.002);
  EXPECT_EQ(figure(*report, "effort_relative_error"), nullptr);
  expect_words(report->verdict.text,
               {"joint one (drive) is not compared",
                "joint one (tracking): the simulation has a motion of its own"});
}

TEST(DiagnoseSimulated, RefusesWhereNothingIsLeftToCompare) {
  const Recording real = named("real.db", {.with_truth = false});
  const auto copied = against({real}, {real}, two_joints());
  ASSERT_FALSE(copied.ok());
  EXPECT_EQ(copied.error().code, core::ErrorCode::kData);
  expect_words(copied.error().message, {"nothing to compare", "recorded effort"});
  const auto elsewhere =
      against({real}, {named("forward.db", {.seed = 9, .with_truth = false})}, two_joints());
  ASSERT_FALSE(elsewhere.ok());
  expect_words(elsewhere.error().message,
               {"moves too differently to be compared row by row: its speed differs by", "deg/s",
                "% of the variance, and 50 % is the most"});
}

TEST(DiagnoseSimulated, SaysWhatItTookForGrantedOfTheTimes) {
  const Recording real = named("real.db", {.with_torque = false}, {.offset_rad = 0.05});
  Recording late = named("late.csv", {.noise = 0.0, .with_torque = false});
  late.meta["assumed_row_period_s"] = "0.01";
  for (std::int64_t& t : late.t_ns) t += 3'600'000'000'000;
  late.t_ns.resize(1400);
  late.samples.conservativeResize(1400, Eigen::NoChange);
  const auto report = against({real}, {late}, two_joints());
  ASSERT_TRUE(report.ok()) << report.error().message;
  expect_words(report->verdict.text, {"late.csv has no time in each row",
                                      "the times of late.csv and real.db nowhere overlap",
                                      "late.csv covers 1400 of 1500 rows"});
}

}  // namespace
