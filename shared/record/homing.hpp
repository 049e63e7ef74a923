// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "record/recording.hpp"

namespace ravencal::record {

/// Whether the robot's zeros were found, for the first time or anew.
inline bool is_homing(const Event& event) {
  return event.kind == "homing" || event.kind == "rehoming";
}

}  // namespace ravencal::record
