// SPDX-License-Identifier: Apache-2.0
#include "experiment/power.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/random.hpp"
#include "core/temporary_folder.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "record/load.hpp"
#include "simulation/session.hpp"

namespace ravencal::experiment {
namespace {

using diagnose::Suggestion;

/// Of Exercise::kLoaded.
constexpr double kTestWeight_kg = 0.5;

/// One run of the twin, diagnosed with the nominal plant under the same load.
core::Result<diagnose::Report> tried(const trajectory::Trajectory& motion, bool loaded,
                                     physics::Plant robot, const Trial& trial, std::uint64_t seed) {
  physics::Plant nominal = trial.nominal;
  if (loaded) {
    robot.payload.mass_kg += kTestWeight_kg;
    nominal.payload.mass_kg += kTestWeight_kg;
  }
  RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder folder, core::TemporaryFolder::create());
  const std::filesystem::path file = folder.path() / "twin.db";
  simulation::SessionOptions session;
  session.seed = seed;
  session.homing_seed = seed;
  const auto summary = simulation::record_session(robot, motion, file, session,
                                                  [&](double) { return trial.look(); });
  if (!summary.ok()) return summary.error();
  record::LoadOptions load;
  load.keep = [](const record::Channel& c) { return c.role != record::Role::kFeature; };
  auto recording = record::load_recording(file, load);
  if (!recording.ok()) return recording.error();
  if (summary->interrupted)
    return core::Error{core::ErrorCode::kUsage, "stopped before the powers were predicted"};
  diagnose::Options options;
  options.seed = seed;
  options.look = [&](double, std::string_view) { return trial.look(); };
  return diagnose::diagnose({*recording}, {}, nominal, options);
}

/// The plant with what was found moved within its intervals; a size keeps its sign.
physics::Plant drawn(physics::Plant plant, const std::vector<ReportedEffect>& reported,
                     std::uint64_t seed) {
  core::Random random(seed);
  for (const ReportedEffect& b : reported) {
    for (physics::Joint& joint : plant.joints) {
      for (physics::Effect& effect : joint.effects) {
        if (joint.name != b.joint || effect.id != b.id) continue;
        for (const diagnose::NamedParameter& p : b.parameters) {
          const auto value = effect.parameters.find(p.name);
          if (value == effect.parameters.end()) continue;
          const double deviation = (p.ci95.second - p.ci95.first) / (2.0 * diagnose::kNormal95);
          const double moved = value->second + deviation * random.normal();
          if (moved * value->second > 0.0) value->second = moved;
        }
      }
    }
  }
  return plant;
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

double PredictedPower::information_bits(double prior) const {
  const auto entropy = [](double p) {
    return p <= 0.0 || p >= 1.0 ? 0.0 : -p * std::log2(p) - (1.0 - p) * std::log2(1.0 - p);
  };
  const double there = (parted + 1.0) / (repetitions + 2.0);
  const double absent = (named_anyway + 1.0) / (repetitions + 2.0);
  return entropy(prior * there + (1.0 - prior) * absent) - prior * entropy(there) -
         (1.0 - prior) * entropy(absent);
}

core::Result<std::vector<ReportedEffect>> reported_effects(const std::string& report_json,
                                                           const std::string& source) {
  try {
    std::vector<ReportedEffect> out;
    for (const auto& effect : nlohmann::json::parse(report_json).at("effects")) {
      ReportedEffect b{effect.at("id"), effect.at("joint"), effect.value("probability", 1.0), {}};
      for (const auto& p : effect.at("parameters"))
        b.parameters.push_back({p.at("name"), p.at("value"), p.at("unit"), p.at("ci95")});
      out.push_back(std::move(b));
    }
    return out;
  } catch (const nlohmann::json::exception& error) {
    return core::data_error(
        fmt::format("{}: not a report of `ravencal diagnose`: {}", source, error.what()));
  }
}

core::Result<PredictedPower> predict_power(const Suggestion& s,
                                           const trajectory::Trajectory& motion,
                                           const Trial& trial) {
  const bool loaded = s.motion == diagnose::Exercise::kLoaded;
  PredictedPower power;
  power.with_effect = s.ids.size() > 1;
  for (int r = 0; r < trial.repetitions; ++r) {
    const std::uint64_t own = trial.seed + static_cast<std::uint64_t>(r);
    RAVENCAL_ASSIGN_OR_RETURN(
        const diagnose::Report with,
        tried(motion, loaded, drawn(trial.improved, trial.reported, own), trial, own));
    const diagnose::NamedEffect* found = named(with, s);
    power.parted += found != nullptr && !is_tied(*found, s) ? 1 : 0;
    power.testable += is_testable(with, s) ? 1 : 0;
    ++power.repetitions;
    if (!power.with_effect) continue;
    RAVENCAL_ASSIGN_OR_RETURN(const diagnose::Report without,
                              tried(motion, loaded, trial.nominal, trial, own + 1000));
    power.named_anyway += named(without, s) != nullptr ? 1 : 0;
  }
  return power;
}

}  // namespace ravencal::experiment
