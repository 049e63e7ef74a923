// SPDX-License-Identifier: Apache-2.0
#include "methods/physics_terms.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "core/whole_file.hpp"
#include "physics/arm_dynamics.hpp"
#include "physics/cable_replay.hpp"
#include "physics/effects/slip_element.hpp"
#include "physics/plant.hpp"

namespace ravencal::methods {
namespace {

using nlohmann::json;

/// Elements of diagnose's hysteresis: a third, once and three times its width.
constexpr std::array kElementWidths = {1.0 / 3.0, 1.0, 3.0};

double value_at(const Series& series, const std::string& channel, Eigen::Index row) {
  const auto it = series.channels.find(channel);
  return it == series.channels.end() ? 0.0 : it->second[row];
}

std::string position_of(const std::string& joint) { return "position of " + joint; }

/// What a joint's columns are made of.
struct Parts {
  std::vector<std::string> channels;  ///< each its own column
  struct Wave {
    double order;
  };
  std::vector<Wave> waves;  ///< sine and cosine of order * own position
  struct Element {
    std::string channel;
    double width;
  };
  std::vector<Element> elements;  ///< elastic-slip elements, [-1, 1]
  std::vector<std::string> names;
};

/// The plant's arm for the weight on its cables, shared by the joints of one stream.
struct Arm {
  physics::Plant plant;
  std::array<std::string, 3> positions;
};

class JointTerms final : public Terms {
 public:
  JointTerms(std::string own, Parts parts, std::optional<physics::CableReplay> cable,
             std::shared_ptr<const Arm> arm, std::size_t index)
      : own_(std::move(own)),
        parts_(std::move(parts)),
        cable_(cable),
        arm_(std::move(arm)),
        index_(index),
        state_(parts_.elements.size(), 0.0),
        last_(parts_.elements.size(), 0.0) {}

  std::unique_ptr<Terms> clone() const override {
    return std::make_unique<JointTerms>(own_, parts_, cable_, arm_, index_);
  }
  Eigen::Index count() const override {
    return static_cast<Eigen::Index>(1 + parts_.channels.size() + 2 * parts_.waves.size() +
                                     parts_.elements.size() + (cable_ ? 1U : 0U));
  }
  std::string text() const override { return fmt::format("{}", fmt::join(parts_.names, ", ")); }

  void start(const Series& series, Eigen::Index row) override {
    std::fill(state_.begin(), state_.end(), 0.0);
    for (std::size_t i = 0; i < last_.size(); ++i)
      last_[i] = value_at(series, parts_.elements[i].channel, row);
    if (cable_) cable_->start(value_at(series, own_, row), load(series, row));
    last_s_ = series.t_s[row];
  }

  void step(const Series& series, Eigen::Index row, Eigen::Ref<Eigen::VectorXd> values) override {
    Eigen::Index at = 0;
    values[at++] = 1.0;
    for (const std::string& channel : parts_.channels)
      values[at++] = value_at(series, channel, row);
    const double q = value_at(series, own_, row);
    for (const Parts::Wave& wave : parts_.waves) {
      values[at++] = std::sin(wave.order * q);
      values[at++] = std::cos(wave.order * q);
    }
    for (std::size_t i = 0; i < state_.size(); ++i) {
      const double x = value_at(series, parts_.elements[i].channel, row);
      state_[i] = physics::slipped(state_[i], 2.0 * (x - last_[i]) / parts_.elements[i].width);
      last_[i] = x;
      values[at++] = state_[i];
    }
    const double dt_s = std::max(0.0, series.t_s[row] - last_s_);
    last_s_ = series.t_s[row];
    if (cable_) values[at++] = -cable_->step(q, load(series, row), dt_s);
  }

 private:
  /// Weight on this joint, N m or N.
  double load(const Series& series, Eigen::Index row) {
    if (!arm_) return 0.0;
    if (!dynamics_) {
      dynamics_.emplace(
          arm_->plant,
          arm_->plant.robot.arm == "green" ? physics::Arm::kGreen : physics::Arm::kGold, true);
    }
    Eigen::Vector3d q;
    for (std::size_t i = 0; i < 3; ++i)
      q[static_cast<Eigen::Index>(i)] = value_at(series, arm_->positions[i], row);
    return dynamics_->gravity(q)[static_cast<Eigen::Index>(index_)];
  }

  std::string own_;
  Parts parts_;
  std::optional<physics::CableReplay> cable_;
  std::shared_ptr<const Arm> arm_;
  std::size_t index_;
  std::vector<double> state_;
  std::vector<double> last_;
  double last_s_ = 0.0;
  std::optional<physics::ArmDynamics> dynamics_;
};

void add_channel(Parts& parts, const std::string& channel) {
  if (std::find(parts.channels.begin(), parts.channels.end(), channel) == parts.channels.end())
    parts.channels.push_back(channel);
}

void add_wave(Parts& parts, double order) {
  const auto same = [&](const Parts::Wave& wave) { return wave.order == order; };
  if (std::none_of(parts.waves.begin(), parts.waves.end(), same)) parts.waves.push_back({order});
}

void add_element(Parts& parts, const std::string& channel, double width) {
  const auto same = [&](const Parts::Element& e) {
    return e.channel == channel && std::abs(e.width - width) < 1e-6 * width;
  };
  if (std::none_of(parts.elements.begin(), parts.elements.end(), same))
    parts.elements.push_back({channel, width});
}

/// What the plant's file says of this joint.
void add_plant_effects(const physics::Joint& joint, Parts& parts) {
  const bool cable = joint.parameter("compliance", "stiffness") > 0.0;
  for (const physics::Effect& effect : joint.effects) {
    const auto number = [&](const char* name) { return joint.parameter(effect.id, name); };
    if (effect.id == "gain_error") add_channel(parts, position_of(joint.name));
    if (effect.id == "coupling") add_channel(parts, position_of(effect.from));
    if (effect.id == "eccentricity") add_wave(parts, number("order"));
    if (effect.id == "backlash" && !cable && number("half_width") > 0.0)
      add_element(parts, position_of(joint.name), 2.0 * number("half_width"));
    for (const char* shown : {"gain_error", "coupling", "eccentricity", "backlash", "compliance",
                              "hysteresis", "joint_friction", "creep", "homing_offset"}) {
      if (effect.id == shown)
        parts.names.push_back(effect.id + (effect.from.empty() ? "" : " from " + effect.from));
    }
  }
}

/// Parameters of one effect of the report by name without "_from_JOINT", and that joint.
struct ReportEffect {
  std::string id, from;
  std::map<std::string, double> values;
};

ReportEffect read_effect(const json& effect) {
  ReportEffect result;
  result.id = effect.at("id").get<std::string>();
  for (const json& p : effect.at("parameters")) {
    std::string name = p.at("name").get<std::string>();
    if (const auto at = name.find("_from_"); at != std::string::npos) {
      result.from = name.substr(at + 6);
      name.resize(at);
    }
    result.values[name] = p.at("value").get<double>();
  }
  return result;
}

/// Parts of the report; a part that the plant's file has already is not added again.
void add_report_effect(const ReportEffect& e, const std::string& joint, Parts& parts) {
  const std::string driver = position_of(e.from.empty() ? joint : e.from);
  const auto value = [&](const char* name) {
    const auto it = e.values.find(name);
    return it == e.values.end() ? 0.0 : it->second;
  };
  const std::size_t before = parts.elements.size() + parts.channels.size() + parts.waves.size();
  if (e.id == "gain_error" || e.id == "coupling") add_channel(parts, driver);
  if (e.id == "eccentricity") add_wave(parts, value("order"));
  if (e.id == "backlash" && value("half_width") > 0.0)
    add_element(parts, driver, 2.0 * value("half_width"));
  if (e.id == "hysteresis" && value("width") > 0.0) {
    for (const double factor : kElementWidths) add_element(parts, driver, factor * value("width"));
  }
  if (e.id == "joint_friction" && value("width") > 0.0) add_element(parts, driver, value("width"));
  if (e.id == "compliance") {
    constexpr std::string_view kTo = "compliance_to_";
    for (const auto& [name, number] : e.values) {
      if (name.starts_with(kTo)) add_channel(parts, name.substr(kTo.size()));
    }
  }
  if (parts.elements.size() + parts.channels.size() + parts.waves.size() > before)
    parts.names.push_back(e.id + (e.from.empty() ? "" : " from " + e.from));
}

}  // namespace

core::Result<std::vector<std::unique_ptr<Terms>>> read_terms(const std::filesystem::path& folder,
                                                             const Problem& problem) {
  // A diagnosis may name effects that no plant file can describe; then only the report is read.
  const auto loaded = physics::load_plant(folder / "plant_improved.toml");
  if (!loaded.ok() && loaded.error().code == core::ErrorCode::kIo) return loaded.error();
  const physics::Plant plant = loaded.ok() ? loaded.value() : physics::Plant{};
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(folder / "report.json"));
  const json report = json::parse(text, nullptr, false);
  if (!report.is_object() || !report.contains("effects") || !report["effects"].is_array()) {
    return core::Error{core::ErrorCode::kData,
                       (folder / "report.json").string() + ": is no report of `ravencal diagnose`"};
  }
  std::shared_ptr<Arm> arm;
  if (plant.joints.size() == 3) {
    arm = std::make_shared<Arm>(Arm{plant, {}});
    for (std::size_t i = 0; i < 3; ++i) arm->positions[i] = position_of(plant.joints[i].name);
  }
  std::vector<std::unique_ptr<Terms>> all;
  try {
    for (const model::OutputSpec& output : problem.outputs) {
      const auto index = plant.joint_index(output.joint);
      if (loaded.ok() && !index) {
        return core::Error{core::ErrorCode::kData,
                           fmt::format("{}: has no joint {}", plant.source, output.joint)};
      }
      Parts parts;
      std::optional<physics::CableReplay> cable;
      if (index) {
        add_plant_effects(plant.joints[*index], parts);
        const physics::CableNumbers numbers = physics::cable_numbers(plant.joints[*index]);
        if (numbers.compliance > 0.0) cable.emplace(numbers);
      }
      for (const json& effect : report["effects"]) {
        const bool between_encoders =
            effect.at("stage") == "transmission" || effect.at("stage") == "sensor";
        if (effect.at("joint") == output.joint && between_encoders)
          add_report_effect(read_effect(effect), output.joint, parts);
      }
      if (!loaded.ok())
        parts.names.push_back("(from the report alone: " + loaded.error().message + ")");
      std::sort(parts.names.begin(), parts.names.end());
      parts.names.erase(std::unique(parts.names.begin(), parts.names.end()), parts.names.end());
      all.push_back(std::make_unique<JointTerms>(position_of(output.joint), std::move(parts), cable,
                                                 cable ? arm : nullptr, index.value_or(0)));
    }
  } catch (const json::exception& error) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: {}", (folder / "report.json").string(), error.what())};
  }
  return all;
}

}  // namespace ravencal::methods
