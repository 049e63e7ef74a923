// SPDX-License-Identifier: Apache-2.0
#include "unit/diagnose_page_sample.hpp"

#include <cmath>
#include <limits>

#include "diagnose/findings/verdict.hpp"

namespace ravencal::diagnose {
namespace {

constexpr const char* kJoints[] = {"shoulder", "elbow", "insertion"};

NamedEffect effect(const std::string& id, const std::string& joint, const std::string& stage,
                   const NamedParameter& parameter) {
  NamedEffect e;
  e.id = id;
  e.joint = joint;
  e.stage = stage;
  e.parameters = {parameter};
  e.unit = stage == "drive" ? "N_m" : "rad";
  e.held_out_before = 0.0123;
  e.held_out_after = 0.0045;
  e.p_value = 0.0005;
  e.size = 0.011;
  e.invariance_spread = 0.07;
  e.separate_by = "repeat the same motion with another weight on the tool";
  return e;
}

ChannelPlot plot(const std::string& joint, const std::string& stage) {
  ChannelPlot p;
  p.joint = joint;
  p.stage = stage;
  p.position_unit = "rad";
  p.load_unit = "N_m";
  p.unit = stage == "drive" ? "N_m" : "rad";
  p.floor = 0.001;
  for (int i = 0; i < 200; ++i) {
    const double t_s = 0.1 * i;
    p.t_s.push_back(t_s);
    p.position.push_back(std::sin(t_s));
    p.speed.push_back(std::cos(t_s));
    p.load.push_back(2.0 * std::cos(0.7 * t_s));
    p.hold_s.push_back(i % 50 < 30 ? 0.0 : 0.1 * (i % 50 - 29));
    p.before.push_back(0.2 + 0.05 * std::sin(t_s));
    p.after.push_back(0.002 * std::sin(7.0 * t_s));
  }
  p.where.position_edges = {-1.0, 0.0, 1.0};
  p.where.speed_edges = {-1.0, 0.0, 1.0};
  p.where.before = {0.2, 0.3, 0.1, std::numeric_limits<double>::quiet_NaN()};
  p.where.after = {0.01, 0.02, 0.01, std::numeric_limits<double>::quiet_NaN()};
  p.where.rows = {50, 60, 70, 0};
  p.waterfall = {{"plant as it is", 0.2}, {"its numbers refitted", 0.1}, {"floor", 0.001}};
  p.scales = {{"gain_error", "position: low third", 0.97, 0.02},
              {"gain_error", "position: high third", 1.02, 0.03}};
  for (const std::size_t recording : {0U, 1U}) {
    Trace t;
    t.t_s = p.t_s;
    t.measured = p.before;
    t.nominal = p.after;
    t.refitted = p.before;
    if (stage != "drive") t.motion = p.position;
    t.recording = recording;
    p.traces.push_back(std::move(t));
  }
  return p;
}

LookedAt looked(const std::string& joint, const std::string& stage) {
  return {joint, stage,       9001, 4000, {0.011, 50.0},       "rad",
          "N_m", {-0.8, 0.9}, 0.61, 0.22, Interval{-1.5, 2.5}, {"position", "direction", "speed"}};
}

Report recordings() {
  Report r;
  r.recordings = {{"zigzag.db", false, 100.4}, {"random.db", true, 90.0}};
  for (const char* joint : kJoints) {
    for (const char* stage : {"drive", "transmission"}) {
      r.looked_at.push_back(looked(joint, stage));
      r.plots.push_back(plot(joint, stage));
    }
    r.not_looked_at.push_back({joint, "command", "the recording lacks the command's inputs"});
    r.not_found.push_back({"creep", joint, 0.0021, "rad", "", "rms"});
    r.not_found.push_back({"slip", joint, std::nullopt, "", "the arm was homed once"});
  }
  r.provenance = {{"recordings", "zigzag.db"}, {"held_out", "random.db"}, {"plant", "raven2.toml"}};
  return r;
}

}  // namespace

Report sample_diagnosis() {
  Report r = recordings();
  for (const char* joint : kJoints)
    r.effects.push_back(effect("payload", joint, "drive", {"mass", 0.494, "kg", {0.45, 0.538}}));
  r.effects.push_back(
      effect("gain_error", "elbow", "transmission", {"ratio", 0.0554, "1", {0.0495, 0.0619}}));
  r.effects.back().ambiguous_with = {"compliance"};
  r.effects.push_back(
      effect("coulomb_friction", "elbow", "drive", {"level", 0.352, "N_m", {0.162, 0.499}}));
  r.effects.push_back(
      effect("viscous_friction", "elbow", "drive", {"damping", 1.7, "N_m_s_per_rad", {1.2, 2.1}}));
  r.held_out = {
      {"shoulder",
       "position_rmse",
       "rad",
       0.0039,
       0.0061,
       0.0005,
       Interval{0.2, 1.0},
       {{1, 0.0039, 0.0061}}},
      {"elbow",
       "position_rmse",
       "rad",
       0.25,
       0.0021,
       0.0014,
       Interval{-0.995, -0.988},
       {{1, 0.25, 0.0021}}},
      {"elbow", "effort_rmse", "N_m", 0.41, 0.12, 0.1, Interval{-0.8, -0.6}, {{1, 0.41, 0.12}}},
      {"elbow", "free_run_1s_rmse", "rad", 0.035, 0.025},
      {"insertion", "position_rmse", "m", 0.0137, 7.2e-05, 2.3e-05, std::nullopt, {}}};
  r.drift = {{"elbow", "rad", 0.5, 0.012, 0.011, 0.009},
             {"elbow", "rad", 1.0, 0.035, 0.031, 0.025}};
  r.left = {
      {"elbow", "transmission", "rad", 0.25, 0.0021, "repetition", 0.0013, 900, 0.93, 0.0024, true},
      {"elbow", "drive", "N_m", 0.41, 0.12, "resolution", 0.003, 0, 0.0, 0.3, true},
      {"insertion", "transmission", "m", 0.0137, 7.2e-05, "none", 0.0, 0, 0.0, 0.0, true}};
  r.two_estimates = {{"elbow",
                      "coulomb_friction",
                      "level",
                      "N_m",
                      0.352,
                      {0.341, 0.363},
                      0.373,
                      {0.367, 0.379},
                      0.0471,
                      true}};
  r.effects.back().p_value = 3e-9;
  r.effects.back().sides = Sides{"motor", "undecided", "take the cable off"};
  r.candidates = {{"elbow", "drive", "coulomb_friction", 0.31, 8.2, 2e-5, 0.35, "N_m", "kept"}};
  decide(r);
  return r;
}

Report sample_of_nothing() {
  Report r = recordings();
  r.held_out = {{"shoulder",
                 "position_rmse",
                 "rad",
                 0.0031,
                 0.003,
                 0.003,
                 Interval{-0.05, 0.02},
                 {{1, 0.0031, 0.003}}}};
  for (const LookedAt& l : r.looked_at)
    r.left.push_back(
        {l.joint, l.stage, "rad", 0.0031, 0.003, "repetition", 0.003, 900, 0.93, 0.0035, true});
  decide(r);
  return r;
}

}  // namespace ravencal::diagnose
