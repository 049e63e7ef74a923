// SPDX-License-Identifier: Apache-2.0
//
// Another simulator's recording at the times of the real one.
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

/// The simulation's channels, linear between its rows, NaN beyond them. Its motion may differ from
/// the robot's, which is what a diagnosis is about; its command may not. Errors (kData): too little
/// of the recording is covered, or the desired positions are of another motion.
core::Result<record::Recording> simulated_recording(const record::Recording& real,
                                                    const record::Recording& simulated,
                                                    std::vector<std::string>& notes);

}  // namespace ravencal::diagnose
