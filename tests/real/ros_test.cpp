// SPDX-License-Identifier: Apache-2.0
//
// The encoder driver among Debian's ROS 1 programs, on a master of the test's own on loopback:
// rostopic and rosbag see what they would see of the authors' node, and the robot's states are
// recorded beside the truth.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/catalogue.hpp"
#include "e2e/ros_rig.hpp"
#include "record/load.hpp"
#include "record/profile.hpp"
#include "record/recording_writer.hpp"

namespace ravencal {
namespace {

namespace fs = std::filesystem;
constexpr std::int64_t kMs = 1'000'000;

using test::Background;
using test::installed;
using test::text_of;
using test::wait_until;

class Ros : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* program : {"rosmaster", "rostopic", "rosbag"}) {
      if (!installed(program))
        GTEST_SKIP() << program
                     << " is not installed (python3-rosmaster, python3-rostopic, "
                        "python3-rosbag)";
    }
    if (!fs::exists(RAVENCAL_ROS_ROBOT))
      GTEST_SKIP() << "built without ROS: libroscpp-dev is not installed";
    folder_ = fs::temp_directory_path() / fmt::format("ravencal_ros_{}", ::getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const int port = test::free_port();
    environment_ = fmt::format(
        "cd {}; export ROS_MASTER_URI=http://127.0.0.1:{} ROS_IP=127.0.0.1 ROS_HOME={} "
        "PATH=/usr/bin:/bin;",
        folder_.string(), port, folder_.string());
    master_command_ =
        fmt::format("{} exec rosmaster --core -p {} >master.log 2>&1", environment_, port);
    write_edges();
    write_states();
    std::ofstream(folder_ / "encoders.toml")
        << R"([recording]
arm = "gold"
[[source]]
name = "r"
kind = "replay"
recording = "edges.db"
speed = 1.0
)" << encoder("shoulder", "counts_per_rev = 80000")
        << encoder("elbow", "counts_per_rev = 80000") << encoder("insertion", "um_per_count = 5");
  }
  void TearDown() override {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }

  static std::string encoder(const char* joint, const char* scale) {
    return fmt::format("[[encoder]]\njoint = \"{}\"\nsource = \"r\"\n{}\nzero_counts = 0\n", joint,
                       scale);
  }

  /// All three encoders go up by 500 counts per second, for longer than a test on a busy machine
  /// takes.
  void write_edges() const {
    record::Recording edges;
    for (const char* joint : {"shoulder", "elbow", "insertion"}) {
      edges.channels.push_back(
          {std::string(joint) + ".counts", "counts", record::Role::kFeature, joint});
      edges.channels.push_back({std::string(joint) + ".lines", "1", record::Role::kStatus, joint});
    }
    constexpr Eigen::Index kRows = 300'000;
    constexpr std::array<double, 4> kLines = {0, 1, 3, 2};
    edges.samples.resize(kRows, 6);
    for (Eigen::Index row = 0; row < kRows; ++row) {
      edges.t_ns.push_back(row * 2 * kMs);
      for (Eigen::Index joint = 0; joint < 3; ++joint) {
        edges.samples(row, 2 * joint) = static_cast<double>(row);
        edges.samples(row, 2 * joint + 1) = kLines[static_cast<std::size_t>(row % 4)];
      }
    }
    const auto written = record::write_recording(edges, folder_ / "edges.db");
    ASSERT_TRUE(written.ok()) << written.error().message;
  }

  /// What the stand-in for the controller says: its elbow stands at 1.25 rad.
  void write_states() const {
    record::Recording states;
    for (const core::CatalogueEntry& entry : core::catalogue())
      states.channels.push_back({entry.name, entry.si_unit, record::Role::kFeature, ""});
    states.t_ns = {0};
    states.samples.setZero(1, static_cast<Eigen::Index>(states.channels.size()));
    states.samples(0, *states.column("jpos.elbow")) = 1.25;
    states.samples(0, *states.column("other.jpos.elbow")) = -0.5;
    const auto written = record::write_recording(states, folder_ / "states.db");
    ASSERT_TRUE(written.ok()) << written.error().message;
  }

  [[nodiscard]] std::string driver(const char* more) const {
    return fmt::format(
        "{} exec {} --config encoders.toml --out run.db --publish-ros {} >driver.log "
        "2>&1",
        environment_, RAVENCAL_ENCODERS, more);
  }
  int run(const std::string& command) const {
    return std::system(("sh -c '" + environment_ + " " + command + "'").c_str());
  }
  [[nodiscard]] bool topic_comes(const char* topic) const {
    return wait_until(
        [&] { return run(fmt::format("rostopic list 2>/dev/null | grep -qx {}", topic)) == 0; });
  }
  /// Of a recording while it is written, as far as it is committed.
  [[nodiscard]] Eigen::Index rows_of(const char* name) const {
    const auto recording = record::load_recording(folder_ / name, {});
    return recording.ok() ? recording->rows() : 0;
  }

  fs::path folder_;
  std::string environment_;
  std::string master_command_;
};

TEST_F(Ros, ToolsOfRosSeeTheTopicsAndOneCommandRecordsRobotAndTruth) {
  Background master(master_command_);
  Background recorder(driver(""));
  ASSERT_TRUE(topic_comes("/ext_jpos")) << text_of(folder_ / "driver.log");
  Background robot(fmt::format("{} exec {} states.db 500 3600 >robot.log 2>&1", environment_,
                               RAVENCAL_ROS_ROBOT));
  EXPECT_EQ(run("rostopic type /ext_jpos > type.txt; rostopic type /joint_enc >> type.txt"), 0);
  EXPECT_EQ(text_of(folder_ / "type.txt"), "sensor_msgs/JointState\nsensor_msgs/JointState\n");
  if (run("python3 -c \"import sensor_msgs\" 2>/dev/null") == 0) {
    EXPECT_EQ(run("timeout 1800 rostopic echo -n 1 /ext_jpos > echo.txt 2>&1"), 0);
    EXPECT_NE(text_of(folder_ / "echo.txt").find("name: \n  - shoulder\n  - elbow\n  - insertion"),
              std::string::npos)
        << text_of(folder_ / "echo.txt");
  }
  EXPECT_EQ(run("timeout 1800 rosbag record -q -O seen.bag --limit 200 /ext_jpos /joint_enc "
                "/ravenstate > bag.log 2>&1"),
            0)
      << text_of(folder_ / "bag.log");
  EXPECT_TRUE(
      wait_until([&] { return rows_of("run.db") > 9000 && rows_of("run.robot.db") > 1000; }));
  EXPECT_EQ(recorder.stop(SIGINT), 0) << text_of(folder_ / "driver.log");
  (void)robot.stop(SIGTERM);

  // The truth as ROS saw it: at 100 Hz and on the motion.
  record::LoadOptions load;
  load.profile = "raven2-bag-truth";
  const auto seen = record::load_recording(folder_ / "seen.bag", load);
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  ASSERT_GT(seen->rows(), 100);
  double least_s = 1.0;
  const auto elbow = *seen->column("truth.elbow");
  const auto insertion = *seen->column("truth.insertion");
  for (Eigen::Index row = 1; row < seen->rows(); ++row) {
    const auto i = static_cast<std::size_t>(row);
    const double dt_s = 1e-9 * static_cast<double>(seen->t_ns[i] - seen->t_ns[i - 1]);
    least_s = std::min(least_s, dt_s);
    EXPECT_NEAR(seen->samples(row, elbow) - seen->samples(row - 1, elbow),
                500.0 * dt_s * 2.0 * M_PI / 80'000.0, 1e-6);
    EXPECT_NEAR(seen->samples(row, insertion) - seen->samples(row - 1, insertion),
                500.0 * dt_s * 5e-6, 1e-8);
  }
  EXPECT_NEAR(least_s, 0.010, 0.004);
  // A bag of ours, as rosbag writes it, imports as states with truth.
  load.profile = "raven2-bag";
  const auto both = record::load_recording(folder_ / "seen.bag", load);
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_NEAR(both->samples(both->rows() / 2, *both->column("jpos.elbow")), 1.25, 1e-6);

  const auto robot_states = record::load_recording(folder_ / "run.robot.db", {});
  ASSERT_TRUE(robot_states.ok()) << robot_states.error().message << text_of(folder_ / "driver.log");
  EXPECT_GT(robot_states->rows(), 1000);
  EXPECT_NEAR(robot_states->samples(0, *robot_states->column("jpos.elbow")), 1.25, 1e-6);
  EXPECT_NEAR(robot_states->samples(0, *robot_states->column("other.jpos.elbow")), -0.5, 1e-6);
  const auto truth = record::load_recording(folder_ / "run.db", {});
  ASSERT_TRUE(truth.ok());
  EXPECT_GT(truth->rows(), 9000);
}

TEST_F(Ros, AMasterThatIsMissingOrDiesHoldsUpNothing) {
  Background recorder(driver(""));
  EXPECT_TRUE(wait_until([&] { return rows_of("run.db") > 1000; })) << "without a master";
  {
    Background master(master_command_);
    EXPECT_TRUE(topic_comes("/joint_enc")) << "a master that comes later is found";
    (void)master.stop(SIGKILL);
  }
  const Eigen::Index rows = rows_of("run.db");
  EXPECT_TRUE(wait_until([&] { return rows_of("run.db") > rows + 1000; })) << "nor after its death";
  EXPECT_EQ(recorder.stop(SIGINT), 0) << text_of(folder_ / "driver.log");
  const auto truth = record::load_recording(folder_ / "run.db", {});
  ASSERT_TRUE(truth.ok());
  const auto counts = *truth->column("shoulder.counts");
  for (Eigen::Index row = 0; row < truth->rows(); ++row)
    ASSERT_TRUE(std::isfinite(truth->samples(row, counts))) << "nothing is lost for ROS's sake";
}

}  // namespace
}  // namespace ravencal
