// SPDX-License-Identifier: Apache-2.0
//
// A calibration session as a list of commands that `ravencal calibrate` runs, in order, with the
// instructions for the person beside the robot. Knows neither ROS nor how commands are run.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::robot {

struct CalibrationOptions {
  std::filesystem::path folder;
  std::string arm = "gold";
  std::string crtk_arm;
  std::vector<std::string> sparsities = {"1/2", "1/3", "1/4", "1/5", "1/6"};
  double validate_s = 300.0;  ///< random motion that chooses the epoch
  double test_s = 300.0;      ///< random motion that nothing is chosen by
  std::string features = "light-open";
  std::string hidden = "128,64,32";
  int epochs = 300;
  std::string precision = "f32";
  double stale_s = 0.2;
  double wait_s = 600.0;
};

struct CalibrationStep {
  std::string id;                    ///< "zigzag_1_3"
  std::string title;                 ///< "zig-zag with sparsity 1/3"
  std::string instruction;           ///< for the person; empty if there is nothing to do
  std::vector<std::string> command;  ///< arguments of `ravencal`
  std::filesystem::path output;      ///< file that it writes; empty if it only checks
  bool moves = false;                ///< the robot moves
};

/// Every path is below the folder.
std::vector<CalibrationStep> calibration_steps(const CalibrationOptions& options);

/// What to load into the controller, in words, at the end.
std::string what_to_load(const CalibrationOptions& options);

/// Finished steps, kept in `calibrate.json` in the folder so that a session can be continued.
class CalibrationSession {
 public:
  /// Begins or continues; error if the folder belongs to a session with other settings.
  static core::Result<CalibrationSession> open(const CalibrationOptions& options);

  /// Done before, and its output is still there.
  [[nodiscard]] bool done(const CalibrationStep& step) const;
  core::Status mark_done(const CalibrationStep& step);
  [[nodiscard]] bool continued() const { return !done_.empty(); }

 private:
  std::filesystem::path file_;
  std::string settings_;
  std::set<std::string> done_;
};

/// Moves what an earlier, stopped attempt left out of the way: NAME.stopped-1.db and so on.
core::Status set_aside(const std::filesystem::path& output);

}  // namespace ravencal::robot
