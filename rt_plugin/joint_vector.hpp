// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "ravencal/plugin.h"

namespace ravencal::rt {

using JointVector = std::array<float, RAVENCAL_JOINTS>;  ///< rad, rad, m

}  // namespace ravencal::rt
