// SPDX-License-Identifier: Apache-2.0
//
// Small RAVEN-II recordings for tests of studies: every channel of raven_state and three truths,
// with joint errors that are known functions of pose and torque.
#pragma once

#include <filesystem>
#include <string>

#include "record/recording.hpp"

namespace ravencal::study {

/// `rows` at 100 Hz. Encoder values of the joints are positions plus `encoder_shift` counts.
record::Recording study_arm(int rows, unsigned seed, double encoder_shift = 0.0);

/// A folder that goes away with the test, and recordings in it.
class StudyFolder {
 public:
  StudyFolder();
  ~StudyFolder();
  StudyFolder(const StudyFolder&) = delete;
  StudyFolder& operator=(const StudyFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Writes study_arm() and returns its path.
  [[nodiscard]] std::string recording(const std::string& name, int rows, unsigned seed) const;

 private:
  std::filesystem::path path_;
};

}  // namespace ravencal::study
