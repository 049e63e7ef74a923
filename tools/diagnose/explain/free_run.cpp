// SPDX-License-Identifier: Apache-2.0
//
// How far off each drive ends up on its own: in windows of several lengths under the recorded
// effort, and over whole stretches under the plant's controller. All plants run with the numbers
// that they state; nothing is fitted.
#include <algorithm>
#include <optional>

#include "diagnose/explain/parts.hpp"
#include "diagnose/explain/plant_drive.hpp"

namespace ravencal::diagnose {
namespace {

constexpr double kWindowS = 1.0;
constexpr double kHorizonsS[] = {0.5, kWindowS, 2.0, 5.0};

std::optional<physics::ServoLaw> law_of(const physics::Plant& plant, const Likelihood& rows,
                                        std::size_t joint) {
  auto law = physics::servo_law(plant.joints[joint]);
  if (!law || law->position <= 0.0) return std::nullopt;
  law->desired_rate = rows.base().laws[joint].desired_rate * law->rate;
  return law;
}

}  // namespace

void add_free_run(const View& view, const physics::Plant& refitted, Report& report) {
  const Likelihood& rows = view.rows;
  for (std::size_t j = 0; j < view.given.joints.size(); ++j) {
    const physics::Joint& joint = view.given.joints[j];
    const bool driven =
        std::any_of(rows.tracks().begin(), rows.tracks().end(),
                    [j](const Track& track) { return track.joints[j].effort.size() > 0; });
    if (!driven) continue;
    const auto add = [&](const char* metric, double before, double after) {
      report.held_out.push_back({joint.name, metric, position_unit_of(joint), before, after});
    };
    PlantDrive given(view.given, rows, j);
    PlantDrive improved(view.improved, rows, j);
    PlantDrive with_own_numbers(refitted, rows, j);
    for (const double horizon_s : kHorizonsS) {
      const PlantDrive::Errors before = given.under_effort(horizon_s);
      if (before.rows == 0.0) continue;
      const Drift drift{joint.name,
                        position_unit_of(joint),
                        horizon_s,
                        before.rms(),
                        with_own_numbers.under_effort(horizon_s).rms(),
                        improved.under_effort(horizon_s).rms()};
      if (horizon_s == kWindowS) add("free_run_1s_rmse", drift.before, drift.after);
      report.drift.push_back(drift);
    }
    const auto given_law = law_of(view.given, rows, j);
    const auto improved_law = law_of(view.improved, rows, j);
    if (!given_law || !improved_law) continue;
    const PlantDrive::Errors closed_before = given.under(*given_law);
    if (closed_before.rows == 0.0) continue;
    const PlantDrive::Errors closed_after = improved.under(*improved_law);
    add("closed_loop_rmse", closed_before.rms(), closed_after.rms());
    add("closed_loop_mae", closed_before.mean(), closed_after.mean());
  }
}

}  // namespace ravencal::diagnose
