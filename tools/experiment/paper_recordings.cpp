// SPDX-License-Identifier: Apache-2.0
#include "experiment/paper_recordings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/outputs.hpp"
#include "core/run_tasks.hpp"
#include "core/version.hpp"
#include "simulation/session.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::experiment {
namespace {

namespace fs = std::filesystem;

/// Sparsities 1/2 to 1/6, sparse ones first.
constexpr std::array kDivisions = {2, 3, 4, 5, 6};
/// All zig-zags together. The authors' follower sends a step for each message and at most 500
/// messages per second, so the robot is slower than the speed limits in its code.
constexpr double kTraining_s = 3244.0;
constexpr double kRowRateHz = 25.0;
constexpr double kLoad_kg = 0.5;
constexpr int kTestRecordings = 6;
constexpr int kHomings = 5;
constexpr double kLongestHomingTest_s = 1200.0;

struct Motion {
  int divisions = 0;  ///< of a zig-zag; 0: random
  double duration_s = 0.0;
};

struct Wanted {
  std::string path;
  Motion motion;
  bool loaded = false;
  std::uint64_t seed = 0;
  std::uint64_t homing_seed = 0;
  std::uint32_t rehomings = 0;
};

/// Power-on sessions.
enum Session : std::uint64_t { kTrain, kTest, kTrainLoaded, kTestLoaded };

/// Lists the recordings; the n-th has the n-th run seed.
class List {
 public:
  List(fs::path folder, std::uint64_t seed)
      : folder_(std::move(folder)), first_seed_(1000 * seed) {}

  std::string add(const std::string& name, Motion motion, bool loaded, Session session,
                  int rehomings) {
    const std::string path = (folder_ / (name + ".db")).string();
    wanted_.push_back({path, motion, loaded, first_seed_ + 1 + wanted_.size(),
                       first_seed_ + 1 + session, static_cast<std::uint32_t>(rehomings)});
    return path;
  }
  [[nodiscard]] const std::vector<Wanted>& wanted() const { return wanted_; }

 private:
  fs::path folder_;
  std::uint64_t first_seed_;
  std::vector<Wanted> wanted_;
};

PaperRecordings listed(List& list, double test_s) {
  PaperRecordings names;
  const auto zigzag = [](int divisions) { return Motion{divisions, 0.0}; };
  for (const bool loaded : {false, true}) {
    const char* load = loaded ? "500g" : "0g";
    for (const int divisions : kDivisions) {
      (loaded ? names.train_loaded : names.train)
          .push_back(list.add(fmt::format("train_{}_zigzag_1_{}", load, divisions),
                              zigzag(divisions), loaded, loaded ? kTrainLoaded : kTrain, 0));
    }
    for (int i = 0; i < kTestRecordings; ++i) {
      (loaded ? names.test_loaded : names.test)
          .push_back(list.add(fmt::format("test_{}_{}", load, i), {0, test_s / kTestRecordings},
                              loaded, loaded ? kTestLoaded : kTest, 0));
    }
  }
  const double homing_test_s = std::min(kLongestHomingTest_s, test_s / kTestRecordings);
  for (int i = 0; i <= kHomings; ++i) {
    names.test_homing.push_back(
        list.add(fmt::format("test_homing_{}", i), {0, homing_test_s}, false, kTrain, i));
  }
  // The first zig-zag before any further homing, each other one after a homing that no test has.
  names.train_rehomed.push_back(names.train.front());
  for (std::size_t i = 1; i < kDivisions.size(); ++i) {
    const int homing = kHomings + static_cast<int>(i);
    names.train_rehomed.push_back(list.add(fmt::format("train_rehomed_zigzag_1_{}", kDivisions[i]),
                                           zigzag(kDivisions[i]), false, kTrain, homing));
  }
  return names;
}

core::Result<double> paper_pace() {
  double total_s = 0.0;
  for (const int divisions : kDivisions) {
    trajectory::ZigzagOptions zigzag;
    zigzag.divisions = divisions;
    RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory made, trajectory::make_zigzag(zigzag));
    total_s += made.duration_s();
  }
  return total_s / kTraining_s;
}

core::Result<trajectory::Trajectory> trajectory_of(const Wanted& wanted, double pace) {
  if (wanted.motion.divisions > 0) {
    trajectory::ZigzagOptions zigzag;
    zigzag.divisions = wanted.motion.divisions;
    zigzag.pace = pace;
    return trajectory::make_zigzag(zigzag);
  }
  trajectory::RandomOptions random;
  random.duration_s = wanted.motion.duration_s;
  random.seed = wanted.seed;
  random.pace = pace;
  return trajectory::make_random(random);
}

/// True if the recording is there now; a stopped one leaves nothing.
core::Result<bool> record(const physics::Plant& plant, const Wanted& wanted, double pace,
                          const simulation::ProgressFunction& progress) {
  if (fs::exists(wanted.path)) return true;
  physics::Plant robot = plant;
  if (wanted.loaded) robot.payload.mass_kg = kLoad_kg;
  RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory motion, trajectory_of(wanted, pace));
  simulation::SessionOptions session;
  session.seed = wanted.seed;
  session.homing_seed = wanted.homing_seed;
  session.rehomings = wanted.rehomings;
  session.rate_hz = kRowRateHz;
  session.trajectory_name = fs::path(wanted.path).stem().string();
  session.overwrite = true;
  const std::string part = wanted.path + ".part.db";
  core::may_renew(part);  // of a run that was killed
  RAVENCAL_ASSIGN_OR_RETURN(const simulation::SessionSummary summary,
                            simulation::record_session(robot, motion, part, session, progress));
  std::error_code error;
  if (summary.interrupted) {
    fs::remove(part, error);
    return false;
  }
  fs::rename(part, wanted.path, error);
  if (error) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: {}", wanted.path, error.message())};
  }
  return true;
}

/// All that the recordings depend on.
std::string name_of(const physics::Plant& plant, const PaperRecordingOptions& options) {
  return fmt::format("plant_{:016x}_seed_{}_test_{:g}_s_version_{}", plant.hash, options.seed,
                     options.test_s, core::kVersion);
}

constexpr double kZigzag_s = kTraining_s / kDivisions.size();  // on the mean

}  // namespace

const std::uint64_t kRowsOfZigzag = static_cast<std::uint64_t>(kZigzag_s * kRowRateHz);

core::Result<PaperWork> missing_paper_recordings(const physics::Plant& plant,
                                                 const PaperRecordingOptions& options,
                                                 const std::filesystem::path& folder) {
  RAVENCAL_RETURN_IF_ERROR(simulation::check_simulation_runs(plant));
  List list(fs::absolute(folder / name_of(plant, options)), options.seed);
  listed(list, options.test_s);
  PaperWork work;
  for (const Wanted& wanted : list.wanted()) {
    if (fs::exists(wanted.path)) continue;
    ++work.recordings;
    work.motion_s += wanted.motion.divisions > 0 ? kZigzag_s : wanted.motion.duration_s;
  }
  return work;
}

core::Result<PaperRecordings> make_stand_ins(const physics::Plant& plant,
                                             const std::filesystem::path& folder) {
  List list(folder, 1);
  PaperRecordings names = listed(list, kTestRecordings);
  constexpr double kStandIn_s = 2.0;
  const auto goes_on = [](double) { return true; };
  for (const std::size_t i : {0U, 1U}) {
    Wanted short_one = list.wanted()[i];
    short_one.motion = {0, kStandIn_s};
    RAVENCAL_RETURN_IF_ERROR(record(plant, short_one, 1.0, goes_on));
  }
  for (auto* trained : {&names.train, &names.train_loaded, &names.train_rehomed})
    std::fill(trained->begin(), trained->end(), list.wanted()[0].path);
  for (auto* tested : {&names.test, &names.test_loaded, &names.test_homing})
    std::fill(tested->begin(), tested->end(), list.wanted()[1].path);
  return names;
}

core::Result<PaperRecordings> make_paper_recordings(const physics::Plant& plant,
                                                    const PaperRecordingOptions& options,
                                                    const std::filesystem::path& folder,
                                                    const std::function<bool(double)>& progress) {
  RAVENCAL_RETURN_IF_ERROR(simulation::check_simulation_runs(plant));
  RAVENCAL_ASSIGN_OR_RETURN(const double pace, paper_pace());
  const fs::path own = folder / name_of(plant, options);
  std::error_code error;
  fs::create_directories(own, error);
  if (error) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: {}", own.string(), error.message())};
  }
  List list(fs::absolute(own), options.seed);
  PaperRecordings recordings = listed(list, options.test_s);
  RAVENCAL_ASSIGN_OR_RETURN(
      const core::TasksDone done,
      core::run_tasks(
          list.wanted().size(), options.workers,
          [&](std::size_t i, const simulation::ProgressFunction& report) {
            return record(plant, list.wanted()[i], pace, report);
          },
          [&](double share, std::size_t, std::size_t) { return progress(share); }));
  recordings.interrupted = done.interrupted;
  return recordings;
}

}  // namespace ravencal::experiment
