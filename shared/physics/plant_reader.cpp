// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/fnv1a.hpp"
#include "core/known_words.hpp"
#include "core/toml_table.hpp"
#include "physics/effects/effect_spec.hpp"
#include "physics/plant.hpp"
#include "physics/plant_checks.hpp"
#include "physics/plant_ranges.hpp"
#include "physics/tolerance_keys.hpp"

namespace ravencal::physics {
namespace {

using core::TomlTable;

template <std::size_t N>
std::array<double, N> array_of(const std::vector<double>& values) {
  std::array<double, N> result{};
  std::copy_n(values.begin(), std::min(N, values.size()), result.begin());
  return result;
}

core::Status read_robot(TomlTable& root, Robot& robot, bool& gravity_stated) {
  auto table = root.table("robot");
  if (!table) {
    root.fail_missing("[robot]");
    return root.finish();
  }
  robot.name = table->text("name");
  robot.arm = table->text_or("arm", "");
  if (table->has("controller")) {
    const std::string name = table->text("controller");
    if (const ControllerBranch* branch = find_controller_branch(name)) {
      robot.controller = *branch;
    } else {
      table->fail("controller",
                  fmt::format("controller '{}' is not one of {}", name, controller_branch_names()));
    }
  }
  robot.control_rate_hz = table->number_or("control_rate_hz", 1000.0, kControlRateRange);
  robot.inner_rate_hz = table->number_or("inner_rate_hz", 10000.0, kInnerRateRange);
  gravity_stated = table->has("gravity_m_per_s2");
  if (gravity_stated)
    robot.gravity_m_per_s2 = array_of<3>(table->numbers("gravity_m_per_s2", 3, kGravityRange));
  if (table->has("tool_joints_rad"))
    robot.tool_joints_rad = array_of<4>(table->numbers("tool_joints_rad", 4, kPositionRange));
  robot.rehoming_shift_counts = table->number_or("rehoming_shift_counts", 0.0, kCountsRange);
  const double steps = robot.inner_rate_hz / robot.control_rate_hz;
  if (!(robot.control_rate_hz > 0.0) || !(steps >= 1.0) || steps != std::floor(steps)) {
    table->fail("inner_rate_hz", "inner_rate_hz must be a whole multiple of control_rate_hz");
  }
  return table->finish();
}

core::Status read_environment(TomlTable& root, Plant& plant) {
  if (auto table = root.table("payload")) {
    plant.payload.mass_kg = table->number("mass_kg", kMassRange);
    plant.payload.com_m = array_of<3>(table->numbers("com_m", 3, kLengthRange));
    RAVENCAL_RETURN_IF_ERROR(table->finish());
  }
  if (auto table = root.table("sensors")) {
    plant.sensors.motor_encoder_counts_per_rev =
        table->number("motor_encoder_counts_per_rev", kCountsPerRevRange);
    RAVENCAL_RETURN_IF_ERROR(table->finish());
  }
  if (auto table = root.table("logger")) {
    plant.logger.rate_hz = table->number("rate_hz", kRowRateRange);
    plant.logger.truth_period_s = table->number("truth_period_s", kPeriodRange);
    plant.logger.truth_latency_s = table->number("truth_latency_s", kLatencyRange);
    plant.logger.truth_latency_deviation_s =
        table->number("truth_latency_deviation_s", kLatencyRange);
    plant.logger.given = true;
    RAVENCAL_RETURN_IF_ERROR(table->finish());
  }
  return {};
}

core::Status read_link(TomlTable& joint, Link& link) {
  auto table = joint.table("link");
  if (!table) return {};
  link.mass_kg = table->number("mass_kg", kMassRange);
  link.com_m = array_of<3>(table->numbers("com_m", 3, kLengthRange));
  link.inertia_kg_m2 = array_of<3>(table->numbers("inertia_kg_m2", 3, kInertiaRange));
  return table->finish();
}

/// A vector of length one; an error where it has none.
template <std::size_t N>
void normalise(TomlTable& table, std::string_view key, std::array<double, N>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  if (!(squares > 0.0)) return table.fail(key, fmt::format("{} must not be zero", key));
  for (double& value : values) value /= std::sqrt(squares);
}

core::Status read_frame(TomlTable& joint, std::optional<Frame>& frame) {
  auto table = joint.table("frame");
  if (!table) return {};
  frame.emplace();
  frame->carried_by = table->text_or("carried_by", "");
  frame->position_m = array_of<3>(table->numbers("position_m", 3, kLengthRange));
  if (table->has("rotation_wxyz")) {
    frame->rotation = array_of<4>(table->numbers("rotation_wxyz", 4, kDirectionRange));
    normalise(*table, "rotation_wxyz", frame->rotation);
  }
  if (table->has("axis")) {
    frame->axis = array_of<3>(table->numbers("axis", 3, kDirectionRange));
    normalise(*table, "axis", frame->axis);
  }
  return table->finish();
}

core::Status read_limits(TomlTable& joint, JointKind kind, Limits& limits) {
  auto table = joint.table("limits");
  if (!table) return {};
  const auto read = [&](std::string_view name, Dimension dimension, const core::NumberRange& range,
                        std::optional<double>& value) {
    const std::string key = std::string(name) + std::string(unit_suffix(dimension, kind));
    if (table->has(key)) value = table->number(key, range);
    return key;
  };
  read("low", Dimension::kPosition, kPositionRange, limits.low_ji);
  const std::string high = read("high", Dimension::kPosition, kPositionRange, limits.high_ji);
  read("speed", Dimension::kVelocity, kSpeedRange, limits.speed_ji);
  if (limits.low_ji && limits.high_ji && !(*limits.low_ji < *limits.high_ji))
    table->fail(high, fmt::format("{} {} is not above the lower limit {}", high, *limits.high_ji,
                                  *limits.low_ji));
  return table->finish();
}

core::Status read_drive(TomlTable& joint, Drive& drive) {
  auto table = joint.table("drive");
  if (!table) return {};
  drive.input = table->text("input");
  drive.gain = table->number_or("gain", 1.0, kGainRange);
  drive.dac_counts_per_n_m = table->number_or("dac_counts_per_n_m", 0.0, kGainRange);
  constexpr std::array<std::string_view, 4> kInputs = {"torque_n_m", "force_n", "voltage_v",
                                                       "current_a"};
  if (std::find(kInputs.begin(), kInputs.end(), drive.input) == kInputs.end()) {
    table->fail("input",
                fmt::format("input '{}' is not one of {}", drive.input, fmt::join(kInputs, ", ")));
  }
  return table->finish();
}

core::Status read_external_load(TomlTable& joint, std::optional<ExternalLoad>& load) {
  auto table = joint.table("external_load");
  if (!table) return {};
  load.emplace();
  load->channel = table->text("channel");
  load->ratio = table->number_or("ratio", 1.0);
  return table->finish();
}

core::Status read_controller(TomlTable& joint, std::optional<Controller>& controller) {
  auto table = joint.table("controller");
  if (!table) return {};
  controller.emplace();
  controller->kp_n_m_per_rad = table->number("kp_n_m_per_rad", kStiffnessRange);
  controller->kd_n_m_s_per_rad = table->number("kd_n_m_s_per_rad", kDampingRange);
  controller->dac_limit_counts = table->number("dac_limit_counts", kCountsRange);
  controller->gravity_compensation = table->boolean_or("gravity_compensation", false);
  return table->finish();
}

core::Status read_homing(TomlTable& joint, JointKind kind, std::optional<Homing>& homing) {
  auto table = joint.table("homing");
  if (!table) return {};
  const auto key = [kind](std::string_view name, Dimension dimension) {
    return std::string(name) + std::string(unit_suffix(dimension, kind));
  };
  homing.emplace();
  homing->speed_ji = table->number(key("speed", Dimension::kVelocity), kVelocityRange);
  homing->dac_threshold_counts = table->number("dac_threshold_counts", kCountsRange);
  homing->stop_controller_ji =
      table->number(key("stop_controller", Dimension::kPosition), kPositionRange);
  homing->stop_encoder_ji =
      table->number(key("stop_encoder", Dimension::kPosition), kPositionRange);
  homing->stop_stiffness =
      table->number(key("stop_stiffness", Dimension::kStiffness), kStiffnessRange);
  homing->stop_damping = table->number(key("stop_damping", Dimension::kDamping), kDampingRange);
  homing->home_ji = table->number(key("home", Dimension::kPosition), kPositionRange);
  return table->finish();
}

std::optional<Through> read_through(TomlTable& joint) {
  constexpr std::array<Through, 2> kAll = {Through::kLink, Through::kDrive};
  if (!joint.has("coupling_through")) return std::nullopt;
  const std::string word = joint.text("coupling_through");
  std::string known;
  for (const Through through : kAll) {
    if (word == through_word(through)) return through;
    known += (known.empty() ? "" : ", ") + std::string(through_word(through));
  }
  joint.fail("coupling_through",
             fmt::format("coupling_through '{}' is not one of {}", word, known));
  return std::nullopt;
}

std::vector<std::string> known_effect_ids() {
  std::vector<std::string> ids;
  for (const EffectSpec& spec : effect_specs()) ids.emplace_back(spec.id);
  return ids;
}

core::Result<Effect> read_effect(TomlTable& table, const Joint& joint) {
  Effect effect;
  effect.id = table.text("id");
  const EffectSpec* spec = find_effect_spec(effect.id);
  if (spec == nullptr) {
    table.fail("id", fmt::format("unknown effect '{}'{}", effect.id,
                                 core::instead_of(effect.id, known_effect_ids())));
    return table.finish().error();
  }
  if (effect.id == "coupling") effect.from = table.text("from");
  if (effect.id == "hysteresis" || effect.id == "compliance")
    effect.from = table.text_or("from", "");
  if (effect.id == "compliance") effect.posture = table.text_or("posture", "");
  for (const ParameterSpec& parameter : spec->parameters) {
    const std::string key = key_of(parameter, joint.kind);
    if (!parameter.required && !table.has(key)) continue;
    effect.parameters.emplace(parameter.name, table.number(key, range_of(parameter)));
  }
  if (const std::string flaw = flaw_of(effect); !flaw.empty()) table.fail("id", flaw);
  RAVENCAL_RETURN_IF_ERROR(table.finish());
  return effect;
}

core::Status read_effects(TomlTable& table, Joint& joint) {
  for (TomlTable& effect_table : table.tables("effect")) {
    RAVENCAL_ASSIGN_OR_RETURN(Effect effect, read_effect(effect_table, joint));
    const bool twice =
        std::any_of(joint.effects.begin(), joint.effects.end(), [&](const Effect& other) {
          return effect.id != "coupling" && other.id == effect.id && other.from == effect.from &&
                 other.posture == effect.posture;
        });
    if (twice) {
      effect_table.fail("id",
                        fmt::format("joint '{}' has effect '{}' twice", joint.name, effect.id));
      return effect_table.finish();
    }
    joint.effects.push_back(std::move(effect));
  }
  return {};
}

core::Result<Joint> read_joint(TomlTable& table) {
  Joint joint;
  joint.name = table.text("name");
  const std::string kind = table.text("kind");
  if (kind != "revolute" && kind != "prismatic") {
    table.fail("kind", fmt::format("kind '{}' is not revolute or prismatic", kind));
  }
  if (table.failed()) return table.finish().error();  // the kind decides the other keys' names
  joint.kind = kind == "prismatic" ? JointKind::kPrismatic : JointKind::kRevolute;
  const bool revolute = joint.kind == JointKind::kRevolute;
  joint.motor_inertia_kg_m2 = table.number_or("motor_inertia_kg_m2", kNoInertia_kg_m2, kRotorRange);
  joint.gearbox_ratio = table.number_or("gearbox_ratio", 1.0, kTransmissionRange);
  joint.reduction =
      table.number_or(revolute ? "reduction" : "reduction_rad_per_m", 1.0, kTransmissionRange);
  joint.encoder_sign = table.number_or("encoder_sign", 1.0, kSignRange);
  joint.joint_encoder_resolution_ji =
      table.number_or(revolute ? "joint_encoder_resolution_rad" : "joint_encoder_resolution_m", 0.0,
                      kResolutionRange);
  joint.coupling_through = read_through(table);
  RAVENCAL_RETURN_IF_ERROR(read_link(table, joint.link));
  RAVENCAL_RETURN_IF_ERROR(read_frame(table, joint.frame));
  RAVENCAL_RETURN_IF_ERROR(read_limits(table, joint.kind, joint.limits));
  RAVENCAL_RETURN_IF_ERROR(read_drive(table, joint.drive));
  RAVENCAL_RETURN_IF_ERROR(read_external_load(table, joint.external_load));
  RAVENCAL_RETURN_IF_ERROR(read_controller(table, joint.controller));
  RAVENCAL_RETURN_IF_ERROR(read_homing(table, joint.kind, joint.homing));
  RAVENCAL_RETURN_IF_ERROR(read_effects(table, joint));
  if (auto tolerance = table.table("tolerance")) {
    for (const std::string& key : tolerance->unread_keys()) {
      if (const std::string flaw = flaw_of_tolerance(key, joint); !flaw.empty())
        tolerance->fail(key, flaw);
      joint.tolerance.emplace(key, tolerance->number(key, kToleranceRange));
    }
    RAVENCAL_RETURN_IF_ERROR(tolerance->finish());
  }
  RAVENCAL_RETURN_IF_ERROR(table.finish());
  return joint;
}

core::Status read_coupling(TomlTable& root, Plant& plant) {
  const std::size_t count = plant.joints.size();
  plant.coupling.assign(count, std::vector<double>(count, 0.0));
  if (!root.has("coupling")) return {};
  plant.coupling = root.matrix("coupling", count, kCouplingRange);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = i; k < count; ++k) {
      if (plant.coupling[i][k] != 0.0) {
        root.fail("coupling",
                  "coupling must be zero on and above the diagonal: a joint is moved by "
                  "those before it");
      }
    }
  }
  return {};
}

}  // namespace

std::string_view through_word(Through through) {
  return through == Through::kLink ? "link" : "drive";
}

bool coupled(const Plant& plant, std::size_t joint) {
  const auto& row = plant.coupling[joint];
  return std::any_of(row.begin(), row.end(), [](double factor) { return factor != 0.0; });
}

bool carries(const Plant& plant, std::size_t joint, std::size_t link) {
  const std::optional<Frame>& frame = plant.joints[link].frame;
  if (link <= joint || !frame) return link >= joint;
  return !frame->carried_by.empty() && carries(plant, joint, *plant.joint_index(frame->carried_by));
}

const Effect* Joint::find_effect(std::string_view id) const {
  const auto it = std::find_if(effects.begin(), effects.end(), [&](const Effect& effect) {
    return effect.id == id && (id == "coupling" || effect.from.empty());
  });
  return it == effects.end() ? nullptr : &*it;
}

double Joint::parameter(std::string_view effect_id, std::string_view name_of_parameter) const {
  const Effect* effect = find_effect(effect_id);
  if (effect == nullptr) return 0.0;
  const auto it = effect->parameters.find(name_of_parameter);
  return it == effect->parameters.end() ? 0.0 : it->second;
}

std::optional<std::size_t> Plant::joint_index(std::string_view name) const {
  const auto it = std::find_if(joints.begin(), joints.end(),
                               [&](const Joint& joint) { return joint.name == name; });
  if (it == joints.end()) return std::nullopt;
  return static_cast<std::size_t>(it - joints.begin());
}

core::Result<Plant> parse_plant(std::string_view text, const std::string& source) {
  RAVENCAL_ASSIGN_OR_RETURN(TomlTable root, core::parse_toml(text, source, "a plant"));
  Plant plant;
  plant.source = source;
  plant.hash = core::fnv1a(text);
  bool gravity_stated = false;
  RAVENCAL_RETURN_IF_ERROR(read_robot(root, plant.robot, gravity_stated));
  RAVENCAL_RETURN_IF_ERROR(read_environment(root, plant));
  for (TomlTable& table : root.tables("joint")) {
    RAVENCAL_ASSIGN_OR_RETURN(Joint joint, read_joint(table));
    plant.joints.push_back(std::move(joint));
  }
  if (plant.joints.empty()) root.fail("joint", "a plant needs at least one [[joint]]");
  RAVENCAL_RETURN_IF_ERROR(read_coupling(root, plant));
  RAVENCAL_RETURN_IF_ERROR(root.finish());
  RAVENCAL_RETURN_IF_ERROR(check_plant(plant, gravity_stated));
  return plant;
}

}  // namespace ravencal::physics
