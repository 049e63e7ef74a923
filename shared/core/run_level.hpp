// SPDX-License-Identifier: Apache-2.0
//
// Run levels of the RAVEN-II's controller, as raven_state publishes them.
#pragma once

#include <cstdint>

namespace ravencal::core {

enum RunLevel : std::int32_t {
  kEmergencyStop = 0,
  kInit = 1,
  kPedalUp = 2,    ///< the brakes hold; the desired joints are set to the measured ones
  kPedalDown = 3,  ///< the motors follow the desired joints
};

}  // namespace ravencal::core
