// SPDX-License-Identifier: Apache-2.0
//
// Calls that a real-time step must not make, counted per step.
#pragma once

#include <optional>

#include "bench/step_peers.hpp"

namespace ravencal::bench {

/// malloc, free and their kin, of this program and of every library that it loads.
double heap_calls_per_step(const Peer& peer);

/// System calls of the calling thread, counted by ptrace in a child process. Nothing where the
/// system forbids tracing.
std::optional<double> system_calls_per_step(const Peer& peer);

}  // namespace ravencal::bench
