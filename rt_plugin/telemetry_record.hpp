// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt_plugin/instance.hpp"

namespace ravencal::rt {

/// [rt] Keeps what this cycle came to, in the flight recorder and in the telemetry ring: the last
/// act of a step. `step_ns`: what the step took; `doubts` of the cycle are those of `output`.
void record(ravencal_instance& self, const ravencal_state& state, const ravencal_output& output,
            std::uint32_t step_ns) noexcept;

}  // namespace ravencal::rt
