// SPDX-License-Identifier: Apache-2.0
#include "commands/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "commands/simulated_motion.hpp"
#include "core/temporary_folder.hpp"
#include "diagnose/diagnose.hpp"
#include "record/load.hpp"
#include "simulation/session.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::commands {
namespace {

using diagnose::Exercise;
using diagnose::Suggestion;
using Eigen::Vector3d;
using trajectory::Trajectory;

/// Straight to `to`, slowest joint at `speed` of its range per second.
void move(Trajectory& t, const Vector3d& to, double speed) {
  const trajectory::JointLimits limits = trajectory::default_limits();
  const Vector3d share =
      (to - t.joints_ji.back()).cwiseAbs().cwiseQuotient(limits.high_ji - limits.low_ji);
  t.t_s.push_back(t.t_s.back() + std::max(0.02, share.maxCoeff() / speed));
  t.joints_ji.push_back(to);
}

void hold(Trajectory& t, double seconds) {
  t.t_s.push_back(t.t_s.back() + seconds);
  t.joints_ji.push_back(t.joints_ji.back());
}

core::Result<Trajectory> zigzag(double speed) {
  trajectory::ZigzagOptions options;
  options.divisions = 2;
  RAVENCAL_ASSIGN_OR_RETURN(Trajectory t, trajectory::make_zigzag(options));
  for (double& time : t.t_s) time /= speed;
  return t;
}

core::Result<Trajectory> trajectory_for(Exercise motion) {
  const trajectory::JointLimits limits = trajectory::default_limits();
  const Vector3d low = limits.low_ji;
  const Vector3d span = limits.high_ji - limits.low_ji;
  const Vector3d middle = low + 0.5 * span;
  Trajectory t{{0.0}, {middle}};
  switch (motion) {
    case Exercise::kSpeeds: {
      RAVENCAL_ASSIGN_OR_RETURN(Trajectory slow, zigzag(1.0 / 3.0));
      RAVENCAL_ASSIGN_OR_RETURN(const Trajectory fast, zigzag(3.0));
      move(slow, fast.joints_ji.front(), 0.1);
      const double start_s = slow.t_s.back();
      for (std::size_t i = 1; i < fast.t_s.size(); ++i) {
        slow.t_s.push_back(start_s + fast.t_s[i]);
        slow.joints_ji.push_back(fast.joints_ji[i]);
      }
      return slow;
    }
    case Exercise::kHolds:
      for (const double at : {0.1, 0.9}) {
        move(t, low + at * span, 0.1);
        hold(t, 180.0);
      }
      return t;
    case Exercise::kReversals:
      for (const double at : {0.2, 0.5, 0.8}) {
        for (const double width : {0.001, 0.005, 0.025, 0.12}) {
          for (int k = 0; k < 10; ++k)
            move(t, low + (at + (k % 2 == 0 ? 0.5 : -0.5) * width) * span, 0.02);
        }
      }
      return t;
    case Exercise::kOneByOne:
      for (Eigen::Index j = 0; j < 3; ++j) {
        for (int k = 0; k < 8; ++k) {
          Vector3d to = middle;
          to[j] = low[j] + (k % 2 == 0 ? 1.0 : 0.0) * span[j];
          move(t, to, 0.1);
        }
        move(t, middle, 0.1);
      }
      return t;
    case Exercise::kWholeRange:
      for (int k = 0; k < 20; ++k) move(t, low + (k % 2 == 0 ? 1.0 : 0.0) * span, 0.05);
      return t;
    case Exercise::kLoaded:
    case Exercise::kNone:
      break;
  }
  return zigzag(1.0);
}

/// One run of the twin, diagnosed with the nominal plant under the same load.
core::Result<diagnose::Report> tried(Exercise motion, physics::Plant robot, physics::Plant nominal,
                                     std::uint64_t seed, const std::function<bool()>& look) {
  RAVENCAL_ASSIGN_OR_RETURN(const Trajectory motion_wanted, trajectory_for(motion));
  if (motion == Exercise::kLoaded) {
    robot.payload.mass_kg += 0.5;
    nominal.payload.mass_kg += 0.5;
  }
  RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder folder, core::TemporaryFolder::create());
  const std::filesystem::path file = folder.path() / "twin.db";
  simulation::SessionOptions session;
  session.seed = seed;
  session.homing_seed = seed;
  const auto summary = simulation::record_session(robot, motion_wanted, file, session,
                                                  [&](double) { return look(); });
  if (!summary.ok()) return summary.error();
  record::LoadOptions load;
  load.keep = [](const record::Channel& c) { return c.role != record::Role::kFeature; };
  auto recording = record::load_recording(file, load);
  if (!recording.ok()) return recording.error();
  if (summary->interrupted)
    return core::Error{core::ErrorCode::kUsage, "stopped before the powers were predicted"};
  diagnose::Options options;
  options.seed = seed;
  options.look = [&](double, std::string_view) { return look(); };
  return diagnose::diagnose({*recording}, {}, nominal, options);
}

const diagnose::NamedEffect* named(const diagnose::Report& report, const Suggestion& s) {
  for (const diagnose::NamedEffect& e : report.effects) {
    if (e.joint == s.joint && e.id == s.ids.front()) return &e;
  }
  return nullptr;
}

bool is_tied(const diagnose::NamedEffect& e, const Suggestion& s) {
  return s.ids.size() > 1 && std::find(e.ambiguous_with.begin(), e.ambiguous_with.end(),
                                       s.ids.back()) != e.ambiguous_with.end();
}

bool is_testable(const diagnose::Report& report, const Suggestion& s) {
  return std::none_of(report.not_found.begin(), report.not_found.end(), [&](const auto& n) {
    return n.joint == s.joint && n.id == s.ids.front() && !n.detection_limit;
  });
}

}  // namespace

bool can_try(const Suggestion& s, const physics::Plant& plant) {
  return s.motion != Exercise::kNone && !s.ids.empty() && simulation_runs(plant);
}

core::Result<PredictedPower> predict_power(const Suggestion& s, const physics::Plant& nominal,
                                           const physics::Plant& improved, int repetitions,
                                           std::uint64_t seed, const std::function<bool()>& look) {
  PredictedPower power;
  power.with_effect = s.ids.size() > 1;
  for (int r = 0; r < repetitions; ++r) {
    const std::uint64_t own = seed + static_cast<std::uint64_t>(r);
    RAVENCAL_ASSIGN_OR_RETURN(const diagnose::Report with,
                              tried(s.motion, improved, nominal, own, look));
    const diagnose::NamedEffect* found = named(with, s);
    power.parted += found != nullptr && !is_tied(*found, s) ? 1 : 0;
    power.testable += is_testable(with, s) ? 1 : 0;
    ++power.repetitions;
    if (!power.with_effect) continue;
    RAVENCAL_ASSIGN_OR_RETURN(const diagnose::Report without,
                              tried(s.motion, nominal, nominal, own + 1000, look));
    power.named_anyway += named(without, s) != nullptr ? 1 : 0;
  }
  return power;
}

}  // namespace ravencal::commands
