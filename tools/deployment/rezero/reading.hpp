// SPDX-License-Identifier: Apache-2.0
//
// What the robot reads of its joints where it stands, and which error the weights predict there:
// from a recording, or from the telemetry of a running plugin.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "ravencal/control.h"
#include "record/recording.hpp"

namespace ravencal::rezero {

/// The length of a reading.
inline constexpr double kReading_s = 1.0;

/// What tells one homing of joints 1 to 3 from another: the encoder offsets that it found.
using Homing = std::array<std::int32_t, RAVENCAL_JOINTS>;

/// One joint that the weights correct, SI.
struct JointReading {
  std::string joint;
  std::string unit;
  double reading = 0.0;    ///< mean of the robot's own values
  double range = 0.0;      ///< largest minus smallest of these
  double predicted = 0.0;  ///< mean of what the weights ask to add
};

struct Reading {
  std::string source;                ///< file or telemetry
  std::vector<JointReading> joints;  ///< in the order of the model's outputs
  double confidence = 1.0;           ///< the lowest, 0..1: how like the training the inputs are
  std::optional<Homing> homing;      ///< none: the source does not tell
  std::vector<std::string> doubts;   ///< sentences: why the reading is none
};

/// The second that begins `from_s` after the first row; without it, the last one. Errors (kData):
/// no row with all inputs there; a channel of the model is missing; another arm, robot or
/// controller than the model's; joints with a correction in them.
core::Result<Reading> read_recording(const record::Recording& recording,
                                     const model::CalibrationModel& model,
                                     std::optional<double> from_s);

/// The next second of the plugin's ticks. `weights_checksum`: of the blob that the user named.
/// Stops where `keep_going` is false. Errors: those of TelemetryReader::open; kIo where no tick
/// comes; kData where the plugin runs other weights or is too old to say.
core::Result<Reading> read_telemetry(const std::string& name, const model::CalibrationModel& model,
                                     std::uint32_t weights_checksum,
                                     const std::function<bool()>& keep_going);

}  // namespace ravencal::rezero
