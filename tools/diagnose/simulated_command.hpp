// SPDX-License-Identifier: Apache-2.0
//
// Whether a simulation was commanded as the robot was. Its motion may differ, which is what a
// diagnosis is about; its command may not.
#pragma once

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

/// Compares the desired positions of joints that both have. `aligned`: the simulation at the
/// recording's times. Error (kData): the simulation is of another motion, with figures.
core::Status commanded_alike(const record::Recording& real, const record::Recording& aligned);

}  // namespace ravencal::diagnose
