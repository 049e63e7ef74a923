// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "model/calibration_model.hpp"

namespace ravencal::test {

/// The model of tests/golden/weights_v2.blob: every transform, two layers, two outputs, numbers
/// that a person can check in a hex dump.
model::CalibrationModel golden_model();

/// The golden file's bytes.
std::vector<std::byte> golden_bytes();

/// Puts the right checksum over changed bytes, so that the checks behind it are reached.
void repair_checksum(std::vector<std::byte>& bytes);

}  // namespace ravencal::test
