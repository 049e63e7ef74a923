// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/calibration_model.hpp"
#include "model/packed_model.hpp"

namespace ravencal::test {

/// The model of tests/golden/weights_v2.blob: the transforms of version 2.0, two layers, two
/// outputs, numbers that a person can check in a hex dump.
model::CalibrationModel golden_model();

/// The model of tests/golden/weights_v2_1.blob: golden_model() with origin, loop gains and margins.
model::CalibrationModel golden_model_2_1();

/// The model of tests/golden/weights_v2_2.blob: golden_model_2_1() whose lag is a mean with a time
/// constant of 0.5 s, and whose play is one of the absolute value, of 128 s.
model::CalibrationModel golden_model_2_2();

/// The model of the golden files of other precisions: golden_model() with twelve hidden units, one
/// panel, and weights that both precisions round.
model::CalibrationModel golden_wide_model();
/// How that is packed: the inputs of the layers are stated, not measured.
model::Packing golden_packing(model::packed::Precision precision);

/// The golden file's bytes.
std::vector<std::byte> golden_bytes(const std::string& name = "weights_v2.blob");

/// Puts the right checksum over changed bytes, so that the checks behind it are reached.
void repair_checksum(std::vector<std::byte>& bytes);

}  // namespace ravencal::test
