// SPDX-License-Identifier: Apache-2.0
//
// Lets every drive run free, as the plant has it and improved: refits the named effects together,
// writes their values and intervals back, takes the name from effects that do not help, and adds
// how far off the runs end.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "diagnose/channel/channel.hpp"
#include "diagnose/findings/findings.hpp"
#include "diagnose/series/series.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// What the free runs of one joint say; nothing of the report is changed yet.
struct FreeRunVerdict {
  std::vector<HeldOut> held_out;
  std::vector<NamedEffect> values;   ///< refitted: id, parameters with intervals
  std::vector<std::string> demoted;  ///< ids of effects that do not improve the free run
  std::vector<Combination> combinations;
};

/// Mean square of the improved drive's runs, its numbers fitted, over each window that the fit did
/// not see; empty if it cannot run.
Eigen::VectorXd unseen_windows(const SeriesSet& set, const std::vector<ChannelFindings>& findings,
                               std::size_t drive, const physics::Plant& plant,
                               const physics::Plant& improved, const Report& report,
                               std::uint64_t seed);

/// True if the drive with those windows runs better by more than one standard error over windows.
bool runs_better(const Eigen::VectorXd& windows, const Eigen::VectorXd& than);

/// `series[i]` belongs to `findings[i]`; `report` holds all names so far.
FreeRunVerdict judge_drive(const SeriesSet& set, const std::vector<ChannelFindings>& findings,
                           std::size_t drive, const physics::Plant& plant,
                           const physics::Plant& improved, const Report& report,
                           std::uint64_t seed);

/// Applies verdicts in order of joints.
void apply(const FreeRunVerdict& verdict, const Series& drive, Report& report);

}  // namespace ravencal::diagnose
