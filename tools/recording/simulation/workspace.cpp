// SPDX-License-Identifier: Apache-2.0
#include "simulation/workspace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "core/temporary_folder.hpp"
#include "record/load.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::simulation {
namespace {

constexpr std::array kLoads_kg = {0.0, 0.25, 0.5};
/// Enough to pass every pair of joints' ranges; in fast recordings memory bounds it.
constexpr double kLongest_s = 200.0;
constexpr double kShortest_s = 60.0;
constexpr double kRows = 20000.0;

}  // namespace

core::Result<std::vector<record::Recording>> simulated_over_workspace(
    const physics::Plant& plant, double row_period_s, const ProgressFunction& progress) {
  RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder folder, core::TemporaryFolder::create());
  std::vector<record::Recording> recordings;
  for (std::size_t n = 0; n < kLoads_kg.size(); ++n) {
    trajectory::RandomOptions motion;
    motion.duration_s = std::clamp(kRows * row_period_s, kShortest_s, kLongest_s);
    motion.seed = 2001 + n;
    RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory wanted, trajectory::make_random(motion));
    physics::Plant loaded = plant;
    loaded.payload.mass_kg += kLoads_kg[n];
    SessionOptions session;
    session.seed = 3001 + n;
    session.homing_seed = 3001;
    session.rate_hz = 1.0 / row_period_s;
    const std::filesystem::path file = folder.path() / fmt::format("load{}.db", n);
    const auto summary = record_session(loaded, wanted, file, session, [&](double s) {
      return progress((static_cast<double>(n) + s) / kLoads_kg.size());
    });
    auto recording = summary.ok() ? record::load_recording(file, {})
                                  : core::Result<record::Recording>(summary.error());
    if (!recording.ok()) return recording.error();
    if (summary->interrupted)
      return core::Error{core::ErrorCode::kUsage, "stopped before the plant was simulated"};
    recording->source = fmt::format("simulation of {}, {:g} g", plant.source, 1e3 * kLoads_kg[n]);
    recordings.push_back(std::move(*recording));
  }
  return recordings;
}

}  // namespace ravencal::simulation
