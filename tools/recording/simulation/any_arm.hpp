// SPDX-License-Identifier: Apache-2.0
//
// Any plant along a trajectory of its own joints: one joint or thirty, without homing. What RAVEN
// arms have beyond it (homing, DAC counts, disturbances, late encoders): session.hpp.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "simulation/session.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::simulation {

/// record_session() of a plant that the twin does not run. Each joint has its own servo; one
/// without is led by a servo whose gains its inertia gives, and the recording says so. Nothing is
/// drawn: equal arguments give equal recordings. Errors beside those of record_session(): options
/// that only the twin has (kUsage), a plant that needs a recorded load (kData).
core::Result<SessionSummary> record_any_arm(const physics::Plant& plant,
                                            const trajectory::Trajectory& trajectory,
                                            const std::filesystem::path& out,
                                            const SessionOptions& options,
                                            const ProgressFunction& progress);

}  // namespace ravencal::simulation
