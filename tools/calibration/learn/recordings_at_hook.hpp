// SPDX-License-Identifier: Apache-2.0
//
// Training recordings as the model is to see them, and by name and content for its provenance.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// Whether torque, DAC, desired values and pose are taken from the control cycle before, as the
/// plugin sees them at its hook (model/hook_view.hpp).
enum class Latched {
  kAuto,  ///< where rows are one control cycle apart; in slower recordings a cycle does not matter
  kOn,
  kOff
};
bool is_at_hook(Latched latched, const record::Recording& recording);

/// The recordings as they are, or as the plugin sees them at its hook (model/hook_view.hpp).
/// Borrows them.
class RecordingsAtHook {
 public:
  RecordingsAtHook(std::span<const record::Recording* const> recordings, bool at_hook);
  [[nodiscard]] std::span<const record::Recording* const> get() const { return recordings_; }

 private:
  std::vector<const record::Recording*> recordings_;
  std::vector<record::Recording> changed_;
};

/// "run1.db sha256:...; run2.db sha256:...".
std::string files_text(std::span<const record::Recording* const> recordings);

/// Keeps with the model what was implausible in its training (record/plausibility.hpp).
void keep_with(model::CalibrationModel& model, const std::vector<std::string>& implausible);

/// Whether the model was trained on a file with these bytes, under whatever name.
bool was_trained_on(const model::CalibrationModel& model, const record::Recording& recording);

}  // namespace ravencal::learn
