// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace ravencal::prove {
namespace {

RecordingForm own_form(const CaseNeeds& needs, Random& random) {
  constexpr std::array<double, 4> kSlowRates = {25.0, 50.0, 100.0, 100.0};
  constexpr std::array<double, 4> kRichRates = {100.0, 100.0, 200.0, 500.0};
  const bool rich = random.uniform() < (needs.rich ? 0.8 : 0.5);
  const double rate_hz = (rich ? kRichRates : kSlowRates)[random.below(4)];
  return {rich ? MotionKind::kRich : MotionKind::kSlow, rate_hz, needs.duration_s,
          needs.held_out_s};
}

/// Lengths from a twelfth of what was asked for to two and a half times it: 20 s to 10 min. Long
/// recordings have low rates, so that a case stays small.
RecordingForm other_form(const CaseNeeds& needs, Random& random) {
  constexpr double kShortestS = 20.0, kLargestCaseRows = 60000.0;
  RecordingForm form;
  form.duration_s = random.log_uniform(std::max(kShortestS, needs.duration_s / 12.0),
                                       std::max(kShortestS, needs.duration_s * 2.5));
  form.held_out_s = std::min(needs.held_out_s, form.duration_s);
  std::vector<double> rates;
  for (const double rate_hz : {50.0, 100.0, 200.0, 250.0, 500.0, 1000.0})
    if (rate_hz * form.duration_s <= kLargestCaseRows || rates.empty()) rates.push_back(rate_hz);
  form.rate_hz = rates[random.below(rates.size())];
  const double choice = random.uniform();
  if (needs.rich)
    form.motion = choice < 0.6   ? MotionKind::kRich
                  : choice < 0.8 ? MotionKind::kFast
                                 : MotionKind::kSlow;
  else
    form.motion = choice < 0.35   ? MotionKind::kSlow
                  : choice < 0.7  ? MotionKind::kRich
                  : choice < 0.88 ? MotionKind::kFast
                                  : MotionKind::kOneWay;
  return form;
}

/// A quarter of the long recordings are of a robot that was homed again. Its zeros repeat to a few
/// counts, which is below the floor: a plant cannot state more.
void home_again(Session& session, double duration_s, Random& random) {
  constexpr double kShortestS = 60.0, kShare = 0.25, kRepeatsToCounts = 5.0;
  const double at_s = duration_s * random.uniform(0.35, 0.65);
  if (random.uniform() >= kShare || duration_s < kShortestS) return;
  session.homed_at_s = at_s;
  for (JointSession& joint : session.joints)
    joint.lost_counts.emplace_back(at_s, std::lround(kRepeatsToCounts * random.normal()));
}

/// A plant can state a PD law alone: the cascade is one where its integral is off.
void other_plant(const CaseNeeds& needs, NominalRobot& nominal, Random& random) {
  const bool states = random.uniform() < 0.4;
  nominal.states_controller = needs.controller || states;
}

void other_laws(const NominalRobot& nominal, double duration_s, Session& session, Random& random) {
  OtherLaws& laws = session.other;
  for (std::size_t i = 0; i < laws.motor_exponent.size(); ++i) {
    laws.motor_exponent[i] = random.uniform(0.7, 1.5);
    laws.joint_exponent[i] = random.uniform(0.7, 1.5);
  }
  const double integral_time_s = random.log_uniform(0.15, 0.6);
  laws.integral_time_s = nominal.states_controller ? 0.0 : integral_time_s;
  laws.velocity_filter_s = 1.0 / (2.0 * std::numbers::pi * random.log_uniform(30.0, 120.0));
  laws.latency_cycles = 1 + static_cast<int>(random.below(3));
  laws.current_lag_s = random.log_uniform(3e-4, 1.5e-3);
  session.robot.mujoco = random.uniform() < 0.5;
  home_again(session, duration_s, random);
}

}  // namespace

const World& own_world() {
  static const World world = {"own",
                              own_form,
                              [](const CaseNeeds&, NominalRobot&, Random&) {},
                              [](const NominalRobot&, double, Session& session, Random& random) {
                                session.robot.mujoco = random.uniform() < 0.2;
                              },
                              run_session,
                              [](const Session& session) -> std::string {
                                return session.robot.mujoco ? "MuJoCo arm, SUNDIALS"
                                                            : "own arm, SUNDIALS";
                              }};
  return world;
}

const World& other_world() {
  static const World world = {"other",
                              other_form,
                              other_plant,
                              other_laws,
                              run_other_session,
                              [](const Session& session) -> std::string {
                                return session.robot.mujoco ? "MuJoCo, other laws"
                                                            : "own arm, other laws";
                              }};
  return world;
}

std::string_view word_of(WorldChoice choice) {
  return kWorldWords[static_cast<std::size_t>(choice)];
}

std::optional<WorldChoice> world_choice(std::string_view word) {
  const auto* const at = std::find(kWorldWords.begin(), kWorldWords.end(), word);
  if (at == kWorldWords.end()) return std::nullopt;
  return static_cast<WorldChoice>(at - kWorldWords.begin());
}

const World& world_of(WorldChoice choice, int number) {
  const bool other =
      choice == WorldChoice::kOther || (choice == WorldChoice::kBoth && number % 2 == 1);
  return other ? other_world() : own_world();
}

}  // namespace ravencal::prove
