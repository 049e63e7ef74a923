// SPDX-License-Identifier: Apache-2.0
#include "physics/plant_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>

#include "core/toml_table.hpp"
#include "physics/effects/effect_spec.hpp"

namespace ravencal::physics {
namespace {

/// Shortest text that reads back to the same bits. With a point or an exponent even where it is
/// whole: an integer of TOML has no negative zero.
std::string number(double value) {
  std::string text = fmt::format("{}", value);
  const bool whole = text.find_first_not_of("-0123456789") == std::string::npos;
  return whole ? text + ".0" : text;
}

std::string list(std::span<const double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + number(value);
  return "[" + text + "]";
}

/// The tables one after the other; those of a joint are indented.
class PlantText {
 public:
  [[nodiscard]] const std::string& text() const { return text_; }

  void table(std::string_view header, bool of_joint) {
    indent_ = of_joint ? "  " : "";
    if (!text_.empty()) text_ += '\n';
    line(header);
  }
  void value(std::string_view key, double value) { line("{} = {}", key, number(value)); }
  void value(std::string_view key, std::span<const double> values) {
    line("{} = {}", key, list(values));
  }
  void value(std::string_view key, std::string_view text) {
    line("{} = {}", key, core::toml_text(text));
  }
  void flag(std::string_view key, bool value) { line("{} = {}", key, value); }
  void unless(double usual, std::string_view key, double given) {
    if (given != usual) value(key, given);
  }
  void matrix(std::string_view key, const std::vector<std::vector<double>>& rows) {
    line("{} = [", key);
    for (const auto& row : rows) line("  {},", list(row));
    line("]");
  }

 private:
  void line(std::string_view whole) {
    fmt::format_to(std::back_inserter(text_), "{}{}\n", indent_, whole);
  }
  template <typename... Parts>
  void line(fmt::format_string<Parts...> form, Parts&&... parts) {
    line(std::string_view(fmt::format(form, std::forward<Parts>(parts)...)));
  }

  std::string text_;
  std::string_view indent_;
};

void write_coupling(PlantText& out, const Plant& plant) {
  const bool any =
      std::any_of(plant.coupling.begin(), plant.coupling.end(), [](const std::vector<double>& row) {
        return std::any_of(row.begin(), row.end(), [](double value) { return value != 0.0; });
      });
  if (any) out.matrix("coupling", plant.coupling);
}

void write_robot(PlantText& out, const Robot& robot) {
  out.table("[robot]", false);
  out.value("name", robot.name);
  if (!robot.arm.empty()) out.value("arm", robot.arm);
  if (!robot.controller.name.empty()) out.value("controller", robot.controller.name);
  out.value("control_rate_hz", robot.control_rate_hz);
  out.value("inner_rate_hz", robot.inner_rate_hz);
  out.value("gravity_m_per_s2", robot.gravity_m_per_s2);
  out.value("tool_joints_rad", robot.tool_joints_rad);
  if (robot.rehoming_shift_counts != 0.0)
    out.value("rehoming_shift_counts", robot.rehoming_shift_counts);
}

void write_environment(PlantText& out, const Plant& plant) {
  if (plant.payload != Payload{}) {
    out.table("[payload]", false);
    out.value("mass_kg", plant.payload.mass_kg);
    out.value("com_m", plant.payload.com_m);
  }
  if (plant.sensors != Sensors{}) {
    out.table("[sensors]", false);
    out.value("motor_encoder_counts_per_rev", plant.sensors.motor_encoder_counts_per_rev);
  }
  if (plant.logger.given) {
    out.table("[logger]", false);
    out.value("rate_hz", plant.logger.rate_hz);
    out.value("truth_period_s", plant.logger.truth_period_s);
    out.value("truth_latency_s", plant.logger.truth_latency_s);
    out.value("truth_latency_deviation_s", plant.logger.truth_latency_deviation_s);
  }
}

void write_link_and_drive(PlantText& out, const Joint& joint) {
  if (joint.link != Link{}) {
    out.table("[joint.link]", true);
    out.value("mass_kg", joint.link.mass_kg);
    out.value("com_m", joint.link.com_m);
    out.value("inertia_kg_m2", joint.link.inertia_kg_m2);
  }
  if (joint.frame) {
    out.table("[joint.frame]", true);
    if (!joint.frame->carried_by.empty())
      out.value("carried_by", std::string_view(joint.frame->carried_by));
    out.value("position_m", joint.frame->position_m);
    if (joint.frame->rotation != Frame{}.rotation)
      out.value("rotation_wxyz", joint.frame->rotation);
    if (joint.frame->axis != Frame{}.axis) out.value("axis", joint.frame->axis);
  }
  if (joint.limits != Limits{}) {
    const auto limit = [&](std::string_view name, Dimension dimension,
                           const std::optional<double>& value) {
      if (value)
        out.value(std::string(name) + std::string(unit_suffix(dimension, joint.kind)), *value);
    };
    out.table("[joint.limits]", true);
    limit("low", Dimension::kPosition, joint.limits.low_ji);
    limit("high", Dimension::kPosition, joint.limits.high_ji);
    limit("speed", Dimension::kVelocity, joint.limits.speed_ji);
  }
  if (joint.drive != Drive{}) {
    out.table("[joint.drive]", true);
    out.value("input", joint.drive.input);
    out.unless(1.0, "gain", joint.drive.gain);
    out.unless(0.0, "dac_counts_per_n_m", joint.drive.dac_counts_per_n_m);
  }
  if (joint.external_load) {
    out.table("[joint.external_load]", true);
    out.value("channel", std::string_view(joint.external_load->channel));
    out.unless(1.0, "ratio", joint.external_load->ratio);
  }
}

void write_servo(PlantText& out, const Joint& joint) {
  if (joint.controller) {
    out.table("[joint.controller]", true);
    out.value("kp_n_m_per_rad", joint.controller->kp_n_m_per_rad);
    out.value("kd_n_m_s_per_rad", joint.controller->kd_n_m_s_per_rad);
    out.value("dac_limit_counts", joint.controller->dac_limit_counts);
    if (joint.controller->gravity_compensation) out.flag("gravity_compensation", true);
  }
  if (!joint.homing) return;
  const auto key = [&joint](std::string_view name, Dimension dimension) {
    return std::string(name) + std::string(unit_suffix(dimension, joint.kind));
  };
  out.table("[joint.homing]", true);
  out.value(key("speed", Dimension::kVelocity), joint.homing->speed_ji);
  out.value("dac_threshold_counts", joint.homing->dac_threshold_counts);
  out.value(key("stop_controller", Dimension::kPosition), joint.homing->stop_controller_ji);
  out.value(key("stop_encoder", Dimension::kPosition), joint.homing->stop_encoder_ji);
  out.value(key("stop_stiffness", Dimension::kStiffness), joint.homing->stop_stiffness);
  out.value(key("stop_damping", Dimension::kDamping), joint.homing->stop_damping);
  out.value(key("home", Dimension::kPosition), joint.homing->home_ji);
}

void write_effect(PlantText& out, const Effect& effect, JointKind kind) {
  out.table("[[joint.effect]]", true);
  out.value("id", effect.id);
  if (!effect.from.empty()) out.value("from", effect.from);
  if (!effect.posture.empty()) out.value("posture", effect.posture);
  const EffectSpec* spec = find_effect_spec(effect.id);
  if (spec == nullptr) return;
  for (const ParameterSpec& parameter : spec->parameters) {
    const auto it = effect.parameters.find(parameter.name);
    if (it != effect.parameters.end()) out.value(key_of(parameter, kind), it->second);
  }
}

void write_joint(PlantText& out, const Joint& joint) {
  const bool revolute = joint.kind == JointKind::kRevolute;
  out.table("[[joint]]", false);
  out.value("name", joint.name);
  out.value("kind", std::string_view(revolute ? "revolute" : "prismatic"));
  if (joint.motor_inertia_kg_m2 > kNoInertia_kg_m2)
    out.value("motor_inertia_kg_m2", joint.motor_inertia_kg_m2);
  out.value("gearbox_ratio", joint.gearbox_ratio);
  out.value(revolute ? "reduction" : "reduction_rad_per_m", joint.reduction);
  out.unless(1.0, "encoder_sign", joint.encoder_sign);
  if (joint.joint_encoder_resolution_ji > 0.0)
    out.value(revolute ? "joint_encoder_resolution_rad" : "joint_encoder_resolution_m",
              joint.joint_encoder_resolution_ji);
  if (joint.coupling_through) out.value("coupling_through", through_word(*joint.coupling_through));
  write_link_and_drive(out, joint);
  write_servo(out, joint);
  for (const Effect& effect : joint.effects) write_effect(out, effect, joint.kind);
  if (joint.tolerance.empty()) return;
  out.table("[joint.tolerance]", true);
  for (const auto& [parameter, relative] : joint.tolerance)
    out.value(core::toml_key(parameter), relative);
}

}  // namespace

std::string plant_text(const Plant& plant) {
  PlantText out;
  write_coupling(out, plant);
  write_robot(out, plant.robot);
  write_environment(out, plant);
  for (const Joint& joint : plant.joints) write_joint(out, joint);
  return out.text();
}

}  // namespace ravencal::physics
