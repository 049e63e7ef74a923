// SPDX-License-Identifier: Apache-2.0
//
// From homings of the training to the joints of a session that nobody has seen, as users type it:
// one known pose takes the session's constant out of the corrected error.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "record/load.hpp"
#include "unit/files_rig.hpp"

namespace ravencal::test {
namespace {

constexpr double kTurning_s = 45.0;  ///< of the motion, after which the arm stands
constexpr double kStanding_s = 2.0;
constexpr double kRow_s = 0.01;
constexpr int kTrainings = 5;
constexpr int kSessions = 6;

/// Sums over the sessions: squares of what is left, and of what the pose itself may leave.
struct Left {
  double before = 0.0, after = 0.0, about_mean = 0.0, of_pose = 0.0;
};

class RezeroTwin : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::string name = (std::filesystem::temp_directory_path() / "ravencal_rezero_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    std::string recordings;
    for (int i = 1; i <= kTrainings; ++i) {
      simulate(i, fmt::format("r{}.db", i), false);
      recordings += fmt::format("r{}.db ", i);
    }
    expect_ok("train " + recordings + "--method linear --out arm.onnx");
    expect_ok("convert arm.onnx --out arm.blob --calibrate r1.db --unbounded-loop");
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder_); }

  static Outcome run(const std::string& arguments) {
    return run_command(fmt::format("cd {} && {} {} 2>&1", folder_.string(), kProgram, arguments));
  }
  static void expect_ok(const std::string& arguments) {
    const Outcome outcome = run(arguments);
    ASSERT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.text;
  }

  /// Random motion of a homing of its own; `stands`: amid it for kStanding_s.
  static void simulate(int number, const std::string& out, bool stands) {
    expect_ok(
        fmt::format("trajectory sinusoid --duration-s 60 --seed {} --out t.csv --force", number));
    if (stands) stand();
    expect_ok(fmt::format(
        "simulate --plant {} --trajectory t.csv --seed {} --homing-seed {} --out {} --force",
        kPlant, number, number, out));
  }
  static void stand() {
    std::istringstream rows(bytes_of(folder_ / "t.csv"));
    std::ofstream changed(folder_ / "t.csv");
    std::string row;
    std::getline(rows, row);
    changed << row << "\n";
    double later_s = 0.0;
    while (std::getline(rows, row)) {
      const double t_s = std::stod(row);
      const std::string joints = row.substr(row.find(','));
      changed << fmt::format("{:.3f}{}\n", t_s + later_s, joints);
      if (std::abs(t_s - kTurning_s) > kRow_s / 2.0) continue;
      for (later_s = kRow_s; later_s < kStanding_s; later_s += kRow_s) {
        changed << fmt::format("{:.3f}{}\n", t_s + later_s, joints);
      }
    }
  }

  /// True joints in the second of the reading, as an external measurement has them.
  static std::string pose_of(const std::string& file) {
    const auto recording = record::load_recording(folder_ / file, {});
    EXPECT_TRUE(recording.ok()) << recording.error().message;
    std::string at;
    for (const std::string joint : {"shoulder", "elbow", "insertion"}) {
      const auto column = recording->column(record::Role::kJointTruth, joint);
      double sum = 0.0;
      int count = 0;
      for (Eigen::Index row = 0; row < recording->rows(); ++row) {
        const auto since_ns =
            recording->t_ns[static_cast<std::size_t>(row)] - recording->t_ns.front();
        const double t_s = 1e-9 * static_cast<double>(since_ns) - (kTurning_s + 0.9);
        if (t_s < 0.0 || t_s > 1.0) continue;
        sum += recording->samples(row, *column);
        ++count;
      }
      at += fmt::format("{}{}={:.7f}{}", at.empty() ? "" : ",", joint, sum / count,
                        joint == "insertion" ? "m+-0.0001m" : "rad+-0.0005rad");
    }
    return at;
  }

  static nlohmann::json hosted(const std::string& more) {
    expect_ok(
        fmt::format("host --plugin {} --weights arm.blob --recording new.db --rate-hz 0 "
                    "--json host.json --force {}",
                    RAVENCAL_PLUGIN_PATH, more));
    return nlohmann::json::parse(bytes_of(folder_ / "host.json"), nullptr, false)["joints"];
  }

  static inline std::filesystem::path folder_;
};

TEST_F(RezeroTwin, OnePoseTakesTheConstantOfASessionOut) {
  std::map<std::string, Left> left;
  int taken = 0;
  for (int session = 1; session <= kSessions; ++session) {
    simulate(100 + session, "new.db", true);
    const Outcome outcome =
        run(fmt::format("rezero --weights arm.blob --recording new.db --when-s {} --at {}",
                        kTurning_s + 0.9, pose_of("new.db")));
    if (outcome.exit_code == 1) {  // one homing in twenty lies beyond the interval
      EXPECT_NE(outcome.text.find("beyond the"), std::string::npos) << outcome.text;
      continue;
    }
    ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
    ++taken;
    const auto file = nlohmann::json::parse(bytes_of(folder_ / "arm.blob.homing.json"));
    const auto before = hosted("");
    const auto after = hosted("--constant arm.blob.homing.json");
    for (std::size_t j = 0; j < before.size(); ++j) {
      const std::string joint = before[j]["joint"];
      const double per_si = joint == "insertion" ? 1000.0 : 180.0 / M_PI;
      Left& of_joint = left[joint];
      of_joint.before += std::pow(before[j]["calibrated"]["rmse"].get<double>(), 2);
      of_joint.after += std::pow(after[j]["calibrated"]["rmse"].get<double>(), 2);
      of_joint.about_mean += std::pow(after[j]["rmse_about_mean"].get<double>(), 2);
      of_joint.of_pose += std::pow(per_si * file["joints"][j]["expected_rest"].get<double>(), 2);
    }
  }
  ASSERT_GE(taken, 3);
  for (const auto& [joint, sums] : left) {
    const auto rms = [&](double squares) { return std::sqrt(squares / taken); };
    std::printf("%-10s before %.4f, after %.4f, about the mean %.4f, of the pose %.4f\n",
                joint.c_str(), rms(sums.before), rms(sums.after), rms(sums.about_mean),
                rms(sums.of_pose));
    EXPECT_LE(rms(sums.after), 1.1 * rms(sums.about_mean) + rms(sums.of_pose)) << joint;
    EXPECT_LT(rms(sums.after), rms(sums.before)) << joint;
  }
}

// Its own homing is in the recording: the plugin takes no other.
TEST_F(RezeroTwin, TheConstantOfAnotherHomingIsNotApplied) {
  simulate(101, "new.db", true);
  const std::string pose = pose_of("new.db");
  expect_ok(fmt::format("rezero --weights arm.blob --recording new.db --when-s {} --at {}",
                        kTurning_s + 0.9, pose.substr(0, pose.find(','))));
  EXPECT_NE(hosted(""), hosted("--constant arm.blob.homing.json")) << "its own homing";
  simulate(110, "new.db", true);
  EXPECT_EQ(hosted(""), hosted("--constant arm.blob.homing.json"));
  const Outcome early =
      run("rezero --weights arm.blob --recording new.db --when-s 0 --at elbow=80deg+-0.1deg");
  EXPECT_EQ(early.exit_code, 1) << early.text;
  EXPECT_NE(early.text.find("moved during the reading"), std::string::npos) << early.text;
}

}  // namespace
}  // namespace ravencal::test
