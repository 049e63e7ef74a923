// SPDX-License-Identifier: Apache-2.0
#include "simulation/session_parts.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "core/version.hpp"

namespace ravencal::simulation {

double rate_of_rows(const physics::Plant& plant, const SessionOptions& options) {
  return options.rate_hz.value_or(plant.logger.rate_hz);
}

core::Result<std::int64_t> cycles_per_row(const physics::Plant& plant,
                                          const SessionOptions& options) {
  const double rate_hz = rate_of_rows(plant, options);
  const double cycles = plant.robot.control_rate_hz / rate_hz;
  if (!(rate_hz > 0.0) || !(cycles >= 1.0) || cycles != std::round(cycles)) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("a rate of {} Hz does not divide the controller's {} Hz",
                                   rate_hz, plant.robot.control_rate_hz)};
  }
  return static_cast<std::int64_t>(cycles);
}

std::map<std::string, std::string> meta_of(const physics::Plant& plant,
                                           const SessionOptions& options) {
  return {{"robot", plant.robot.name},
          {"serial", "simulated"},
          {"source", "ravencal simulate: a plant's simulation, not a robot"},
          {"plant", std::filesystem::path(plant.source).filename().string()},
          {"plant_hash", fmt::format("{:016x}", plant.hash)},
          {"trajectory", options.trajectory_name},
          {"payload_g", fmt::format("{:g}", plant.payload.mass_kg * 1000.0)},
          {"rate_hz", fmt::format("{:g}", rate_of_rows(plant, options))},
          {"software_version", core::kVersion}};
}

}  // namespace ravencal::simulation
