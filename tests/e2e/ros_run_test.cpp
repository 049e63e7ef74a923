// SPDX-License-Identifier: Apache-2.0
//
// `ravencal run` against the virtual RAVEN among Debian's own ROS programs: to the end, with
// pauses, and through faults of robot, network and operator.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>

#include "e2e/ros_rig.hpp"
#include "record/load.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

constexpr double kEndless_s = 1000.0;  ///< of a path that the test ends

class RosRun : public RosRig {
 protected:
  record::Recording recording() const {
    auto loaded = record::load_recording(folder_ / "run.db", {});
    EXPECT_TRUE(loaded.ok()) << loaded.error().message;
    return loaded.ok() ? std::move(loaded).value() : record::Recording();
  }
  static bool has_event(const record::Recording& recording, const std::string& kind) {
    return std::any_of(recording.events.begin(), recording.events.end(),
                       [&](const record::Event& event) { return event.kind == kind; });
  }
  /// The short path in the background, until it moves.
  std::unique_ptr<Background> start_moving(const std::string& more = "") {
    auto running = start("exec " + run_command(more), "run.txt");
    EXPECT_TRUE(wait_until([&] { return !running->running() || rows() > 5; })) << log("run.txt");
    EXPECT_TRUE(running->running()) << log("run.txt");
    return running;
  }
  /// Read by Debian's sqlite3 while it is written.
  [[nodiscard]] long rows() const {
    if (run("test -s run.db && sqlite3 -readonly run.db 'select count(*) from sample'",
            "rows.txt") != 0)
      return 0;
    return std::strtol(log("rows.txt").c_str(), nullptr, 10);
  }
};

TEST_F(RosRun, FromTheEmergencyStopToARecordingWithTruth) {
  start_master();
  start_robot("--speed 8");
  // Not homed yet: it waits, then gives up.
  EXPECT_EQ(run("ravencal-ros run --await-homed --wait-s 0.5 --stale-s 20"), 4);
  ASSERT_TRUE(press("estop false") && press("start"));
  ASSERT_EQ(run("ravencal-ros run --await-homed --wait-s 600 --stale-s 20"), 0) << log("log.txt");
  ASSERT_TRUE(press("pedal true"));
  auto bag = start("exec timeout -s INT 600 rosbag record -q -O seen.bag /ravenstate /ext_jpos",
                   "bag.txt");
  ASSERT_TRUE(wait_until([&] { return fs::exists(folder_ / "seen.bag.active"); }));
  EXPECT_EQ(run(run_command("--json")), 0) << log("log.txt");
  (void)bag->stop(SIGINT);

  const record::Recording run = recording();
  EXPECT_EQ(run.calibratable_joints().size(), 3U);
  EXPECT_TRUE(has_event(run, "start") && has_event(run, "end"));
  EXPECT_GT(run.rows(), 200);
  const auto truth = *run.column("truth.elbow");
  const auto estimate = *run.column("jpos.elbow");
  int with_truth = 0;
  for (Eigen::Index row = 0; row < run.rows(); ++row) {
    if (std::isnan(run.samples(row, truth))) continue;
    ++with_truth;
    // The two zeros differ by 7.5 degrees; the cables add a few.
    EXPECT_NEAR(run.samples(row, truth) - run.samples(row, estimate), -0.13, 0.1);
  }
  EXPECT_GT(with_truth, run.rows() * 8 / 10);

  // What Debian's rosbag recorded meanwhile imports; cut off, it is refused.
  ASSERT_TRUE(wait_until([&] { return fs::exists(folder_ / "seen.bag"); })) << log("bag.txt");
  record::LoadOptions load;
  load.profile = "raven2-bag";
  const auto seen = record::load_recording(folder_ / "seen.bag", load);
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_GT(seen->rows(), 200);
  fs::resize_file(folder_ / "seen.bag", fs::file_size(folder_ / "seen.bag") / 2);
  const auto cut = record::load_recording(folder_ / "seen.bag", load);
  ASSERT_FALSE(cut.ok());
  EXPECT_NE(cut.error().message.find("seen.bag"), std::string::npos);
}

TEST_F(RosRun, PausesWithThePedalAndGoesOnWhereItWas) {
  start_master();
  write_path("short.csv", 5.0, 3.0);  // not over before a busy machine has pressed the pedal
  start_robot("--homed --pedal-down");
  auto running = start_moving("--json");
  ASSERT_TRUE(press("pedal false"));
  ASSERT_TRUE(wait_until([&] { return log("run.txt").find("the pedal") != std::string::npos; }))
      << log("run.txt");
  const long paused_at = rows();
  ASSERT_TRUE(press("pedal true"));
  EXPECT_EQ(running->wait(), 0) << log("run.txt");
  const record::Recording run = recording();
  EXPECT_TRUE(has_event(run, "pause") && has_event(run, "resume") && has_event(run, "end"));
  EXPECT_GT(run.rows(), paused_at);
  EXPECT_NE(log("run.txt").find("\"pauses\": 1"), std::string::npos) << log("run.txt");
}

TEST_F(RosRun, StopsOnEmergencyStopAndKeepsTheRecording) {
  write_path("short.csv", kEndless_s, 3.0);
  start_master();
  start_robot("--homed --pedal-down");
  auto running = start_moving();
  ASSERT_TRUE(press("estop true"));
  EXPECT_EQ(running->wait(), 4);
  EXPECT_NE(log("run.txt").find("stopped: E-stop"), std::string::npos) << log("run.txt");
  const record::Recording run = recording();
  EXPECT_TRUE(has_event(run, "stop"));
  EXPECT_GT(run.rows(), 5);
}

TEST_F(RosRun, StopsWhenTheControlProcessDies) {
  write_path("short.csv", kEndless_s, 3.0);
  start_master();
  start_robot("--homed --pedal-down");
  auto running = start("exec " + run_command("", 6.0), "run.txt");
  ASSERT_TRUE(wait_until([&] { return !running->running() || rows() > 5; }));
  kill_robot(SIGKILL);
  EXPECT_EQ(running->wait(), 4);
  EXPECT_NE(log("run.txt").find("no state from the robot"), std::string::npos) << log("run.txt");
  EXPECT_GT(recording().rows(), 5);
}

TEST_F(RosRun, OutlivesItsMasterAndIsFoundOnTheNextOne) {
  write_path("short.csv", 5.0, 3.0);  // not over before a busy machine has pressed the pedal
  start_master();
  start_robot("--homed --pedal-down");
  auto running = start_moving("--json");
  ASSERT_TRUE(press("pedal false"));  // so that it is under way when the next master has come
  ASSERT_TRUE(wait_until([&] { return log("run.txt").find("the pedal") != std::string::npos; }));
  kill_master();
  start_master();
  EXPECT_TRUE(wait_until([&] {
    return run("rostopic list -p | grep -qx /arm1/servo_jr && rostopic list | grep -qx /ravenstate",
               "list.txt") == 0;
  })) << "both nodes register with the new master";
  EXPECT_TRUE(wait_until([&] { return press("pedal true"); })) << "services, too";
  EXPECT_EQ(running->wait(), 0) << log("run.txt");
  EXPECT_NE(log("run.txt").find("\"completed\": true"), std::string::npos) << log("run.txt");
}

TEST_F(RosRun, SaysThatThereIsNoMaster) {
  EXPECT_EQ(run(run_command("", 20.0, 0.3)), 4);
  EXPECT_NE(log("log.txt").find("no ROS master"), std::string::npos) << log("log.txt");
  EXPECT_FALSE(fs::exists(folder_ / "run.db"));
}

TEST_F(RosRun, RefusesAStateOfAnotherRevision) {
  start_master();
  auto other = start("exec rostopic pub -r 50 /ravenstate std_msgs/Int32 1", "pub.txt");
  EXPECT_EQ(run(run_command("")), 4);
  EXPECT_NE(log("log.txt").find("/ravenstate is published as std_msgs/Int32 with md5"),
            std::string::npos)
      << log("log.txt");
  EXPECT_FALSE(fs::exists(folder_ / "run.db"));
}

TEST_F(RosRun, StopsAndSetsTheBrakesWhenTheOtherArmMoves) {
  start_master();
  start_robot("--homed --pedal-down");
  EXPECT_EQ(run(run_command("--crtk-arm arm1")), 4) << "the green arm's board comes first";
  EXPECT_NE(log("log.txt").find("of the other arm moved"), std::string::npos) << log("log.txt");
  EXPECT_NE(log("log.txt").find("--crtk-arm"), std::string::npos);
  EXPECT_TRUE(wait_until([&] { return run("ravencal-ros run --check --json | grep PAUSED") == 0; }))
      << log("log.txt");
  EXPECT_TRUE(has_event(recording(), "stop"));
}

TEST_F(RosRun, FindsOutWhichCrtkArmIsWhichAndSaysSo) {
  start_master();
  start_robot("--homed --pedal-down --speed 4 --controller crtk --first-arm gold");
  EXPECT_EQ(run(run_command("--arm gold")), 0) << log("log.txt");
  EXPECT_NE(log("log.txt").find("moves an elbow by 0.3 deg and back"), std::string::npos)
      << log("log.txt");
  const record::Recording run = recording();
  const auto probed =
      std::find_if(run.events.begin(), run.events.end(), [](const record::Event& event) {
        return event.kind == "probe" && event.detail == "/arm1/servo_jr drives the gold arm";
      });
  EXPECT_NE(probed, run.events.end());
}

TEST_F(RosRun, SendsPositionsToTheGreenArmOfTheMainBranchAsWell) {
  start_master();
  start_robot("--homed --pedal-down --arm green --speed 4 --controller main");
  EXPECT_EQ(run(run_command("--arm green --mode jp")), 0) << log("log.txt");
  EXPECT_GT(recording().rows(), 200);
}

TEST_F(RosRun, RefusesASecondSenderAndARobotWithoutEncoders) {
  start_master();
  start_robot("--homed --pedal-down --no-encoders");
  auto sender =
      start("exec rostopic pub -r 10 /arm1/servo_jr sensor_msgs/JointState '{}'", "pub.txt");
  ASSERT_TRUE(wait_until(
      [&] { return run("rostopic list -p | grep -qx /arm1/servo_jr", "list.txt") == 0; }));
  EXPECT_EQ(run(run_command("--no-encoders")), 4);
  EXPECT_NE(log("log.txt").find("sends /arm1/servo_jr already"), std::string::npos)
      << log("log.txt");
  (void)sender->stop(SIGTERM);
  EXPECT_EQ(run(run_command("", 20.0, 1.0)), 4);
  EXPECT_NE(log("log.txt").find("no external encoders on /ext_jpos"), std::string::npos)
      << log("log.txt");
}

TEST_F(RosRun, CtrlCEndsTheMotionAndKeepsTheRecording) {
  write_path("short.csv", kEndless_s, 3.0);
  start_master();
  start_robot("--homed --pedal-down");
  auto running = start_moving();
  EXPECT_EQ(running->stop(SIGINT), 0);
  EXPECT_NE(log("run.txt").find("ended by the user"), std::string::npos) << log("run.txt");
  const record::Recording kept = recording();
  EXPECT_GT(kept.rows(), 5);
  EXPECT_TRUE(std::any_of(kept.events.begin(), kept.events.end(), [](const record::Event& event) {
    return event.kind == "stop" && event.detail == "ended by the user";
  }));
}

}  // namespace
}  // namespace ravencal::test
