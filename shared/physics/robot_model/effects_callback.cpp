// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/effects_callback.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "physics/drives.hpp"
#include "physics/robot_model/effects_in_models.hpp"

namespace ravencal::physics {
namespace {

/// After the command: what the file is, and how it is used.
constexpr const char* kHead = R"(//
// Effects of a robot that MJCF cannot state, written by ravencal. Once the model is loaded, call
// ravencal_effects_install(model), once: it sets mjcb_passive, and takes `level` below from the joints' frictionloss,
// whose dry friction it takes over. From Python: ctypes.CDLL("./FILE.so").ravencal_effects_install(ctypes.c_void_p(model._address)),
// linked to the libmujoco of the Python package (-L FOLDER -l:libmujoco.so.VERSION in the place of -lmujoco).
// One simulation at a time: the deflection of the friction is kept here, and starts anew when time runs back. While a
// joint sticks, its friction is a spring of level / presliding: the time step must resolve it. The load on which
// friction depends is that of the last step's acceleration.
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

// SI units of the joint: N m and rad, or N and m.
struct Effects {
  const char* joint;
  // Dry friction: level + load_share |load| + extra / (1 + (v / stribeck_velocity)^2), built up over the displacement
  // `presliding` with `bristle_damping`; half of level_difference more forwards and less backwards. Level 0: none.
  double level, extra, stribeck_velocity, load_share, presliding, bristle_damping, level_difference;
  double damping_by_direction;  // effort against the motion is this times |v| more forwards
  double ripple, ripple_order, ripple_phase;  // ripple sin(order q + phase), against the motion
  double weight, weight_phase;                // weight sin(q + phase), against the motion
};

const Effects kEffects[] = {
)";

constexpr const char* kRest = R"(};

struct State {
  int position = 0, velocity = 0;  // places in qpos and qvel
  double last = 0.0, bristle = 0.0, friction = 0.0;
};
std::vector<State> states;
double last_time_s = 0.0;

double dry_friction(const Effects& e, State& s, double velocity, double dt_s, double load) {
  if (e.level <= 0.0) return 0.0;
  const double by_load = e.load_share * std::abs(load) / e.level;
  const double ratio = velocity / e.stribeck_velocity;
  const double level = (1.0 + by_load) * (e.level + e.extra / (1.0 + ratio * ratio));
  const double stiffness = std::max(1.0, by_load) * e.level / e.presliding;
  const double before = s.bristle;
  s.bristle = (before + velocity * dt_s) / (1.0 + stiffness * std::abs(velocity) * dt_s / level);
  const double held = stiffness * s.bristle + e.bristle_damping * (s.bristle - before) / dt_s;
  return held + 0.5 * e.level_difference * std::min(1.0, std::abs(held) / e.level);
}

void add_effects(const mjModel* m, mjData* d) {
  const double dt_s = d->time - last_time_s;
  std::vector<mjtNum> load(static_cast<std::size_t>(m->nv));
  mj_rne(m, d, 1, load.data());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Effects& e = kEffects[i];
    State& s = states[i];
    const double q = d->qpos[s.position], v = d->qvel[s.velocity];
    if (dt_s < 0.0 || d->time == 0.0) {
      s.bristle = s.friction = 0.0;
      s.last = q;
    } else if (dt_s > 0.0) {
      s.friction = dry_friction(e, s, (q - s.last) / dt_s, dt_s, load[static_cast<std::size_t>(s.velocity)]);
      s.last = q;
    }
    d->qfrc_passive[s.velocity] -= s.friction + e.damping_by_direction * std::abs(v) +
                                   e.ripple * std::sin(e.ripple_order * q + e.ripple_phase) +
                                   e.weight * std::sin(q + e.weight_phase);
  }
  last_time_s = d->time;
}

}  // namespace

// 0, or the number of the first joint above, from 1 on, that the model lacks.
extern "C" int ravencal_effects_install(mjModel* m) {
  states.clear();
  last_time_s = 0.0;
  for (const Effects& e : kEffects) {
    const int joint = mj_name2id(m, mjOBJ_JOINT, e.joint);
    if (joint < 0) return static_cast<int>(states.size()) + 1;
    mjtNum& frictionloss = m->dof_frictionloss[m->jnt_dofadr[joint]];
    frictionloss = std::max(0.0, frictionloss - e.level);
    states.push_back({m->jnt_qposadr[joint], m->jnt_dofadr[joint]});
  }
  mjcb_passive = add_effects;
  return 0;
}
)";

bool has_callback_effect(const Joint& joint) {
  return std::any_of(joint.effects.begin(), joint.effects.end(),
                     [](const Effect& e) { return acts(e) && in_models(e.id).in_callback; });
}

/// True if the friction that MJCF states is not all of it.
bool has_other_friction(const Joint& joint) {
  return joint.parameter("stribeck_friction", "extra") != 0.0 ||
         joint.parameter("presliding", "displacement") != 0.0 ||
         joint.parameter("load_dependent_friction", "load_share") != 0.0 ||
         joint.parameter("asymmetric_friction", "level_difference") != 0.0;
}

/// A name as a literal of C++.
std::string quoted(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const auto sign = static_cast<unsigned char>(c);
    if (sign < 0x20)
      text += fmt::format("\\{:03o}", sign);
    else if (c == '"' || c == '\\')
      text += std::string("\\") + c;
    else
      text += c;
  }
  return "\"" + text + "\"";
}

std::string row_of(const Joint& joint) {
  const WanderingFriction friction = motor_friction(joint);
  const BristleFriction::Parameters& bristle = friction.bristle.parameters();
  const DriveLosses losses = drive_losses(joint);
  return fmt::format(
      "    {{{}, {}, {}, {}, {}, {}, {}, {},\n     {},\n     {}, {}, {},\n     {}, {}}},\n",
      quoted(joint.name), has_other_friction(joint) ? bristle.level : 0.0, bristle.stribeck_extra,
      bristle.stribeck_velocity, friction.load_share, bristle.presliding, bristle.damping,
      friction.level_difference, losses.asymmetry, losses.ripple, losses.ripple_order,
      losses.ripple_phase, losses.weight, losses.weight_phase);
}

}  // namespace

std::string effects_callback(const Plant& plant, const std::string& file) {
  std::string rows;
  for (const Joint& joint : plant.joints)
    if (has_callback_effect(joint)) rows += row_of(joint);
  if (rows.empty()) return {};
  return fmt::format("// g++ -std=c++17 -O2 -shared -fPIC {} -o {}.so -lmujoco\n", file,
                     std::filesystem::path(file).stem().string()) +
         kHead + rows + kRest;
}

}  // namespace ravencal::physics
