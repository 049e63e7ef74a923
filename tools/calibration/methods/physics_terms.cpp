// SPDX-License-Identifier: Apache-2.0
#include "methods/physics_terms.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "physics/arm_dynamics.hpp"
#include "physics/cable_replay.hpp"
#include "physics/effects/slip_element.hpp"
#include "physics/plant.hpp"

namespace ravencal::methods {
namespace {

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
  std::vector<Wave> waves;  ///< sine and cosine of order * position of the joint's own motor
  std::vector<std::pair<std::string, double>> coupled;  ///< what others add to the own position
  struct Element {
    std::string channel;
    double width;
  };
  std::vector<Element> elements;  ///< elastic-slip elements, [-1, 1]
  std::vector<std::string> names;

  [[nodiscard]] std::size_t size() const {
    return channels.size() + waves.size() + elements.size();
  }
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
    double motor = q;
    for (const auto& [channel, factor] : parts_.coupled)
      motor -= factor * value_at(series, channel, row);
    for (const Parts::Wave& wave : parts_.waves) {
      values[at++] = std::sin(wave.order * motor);
      values[at++] = std::cos(wave.order * motor);
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

void add_coupled(Parts& parts, const physics::Plant& plant, const physics::Joint& joint) {
  const std::vector<double>& factors = plant.coupling[*plant.joint_index(joint.name)];
  for (std::size_t k = 0; k < factors.size(); ++k)
    if (factors[k] != 0.0)
      parts.coupled.emplace_back(position_of(plant.joints[k].name), factors[k]);
}

void add_element(Parts& parts, const std::string& channel, double width) {
  const auto same = [&](const Parts::Element& e) {
    return e.channel == channel && std::abs(e.width - width) < 1e-6 * width;
  };
  if (std::none_of(parts.elements.begin(), parts.elements.end(), same))
    parts.elements.push_back({channel, width});
}

bool is_of_cable(const std::string& id) {
  static constexpr std::array kIds = {"compliance", "hysteresis", "backlash", "joint_friction",
                                      "creep"};
  return std::find(kIds.begin(), kIds.end(), id) != kIds.end();
}

/// What the plant says of this joint; effects that need an effort through the cable are the
/// cable's.
Parts parts_of(const physics::Plant& plant, const physics::Joint& joint) {
  Parts parts;
  const bool has_cable = physics::cable_numbers(joint).compliance > 0.0;
  for (const physics::Effect& effect : joint.effects) {
    const auto number = [&](const char* name) { return joint.parameter(effect.id, name); };
    const std::string own = position_of(joint.name);
    const std::string driver = effect.from.empty()              ? own
                               : plant.joint_index(effect.from) ? position_of(effect.from)
                                                                : effect.from;
    const std::size_t before = parts.size();
    if (effect.id == "gain_error" || effect.id == "coupling") add_channel(parts, driver);
    if (effect.id == "compliance" && !effect.from.empty()) add_channel(parts, driver);
    if (effect.id == "eccentricity") {
      parts.waves.push_back({number("order")});
      add_coupled(parts, plant, joint);
    }
    if (effect.id == "backlash" && !has_cable && number("half_width") > 0.0)
      add_element(parts, own, 2.0 * number("half_width"));
    const double width = number("width");
    if (effect.id == "joint_friction" && width > 0.0) add_element(parts, own, width);
    if (effect.id == "hysteresis" && width > 0.0)
      for (const double share : physics::kLoopWidths) add_element(parts, driver, share * width);
    if (parts.size() > before || (has_cable && is_of_cable(effect.id)))
      parts.names.push_back(effect.id + (effect.from.empty() ? "" : " from " + effect.from));
  }
  std::sort(parts.names.begin(), parts.names.end());
  return parts;
}

}  // namespace

core::Result<std::vector<std::unique_ptr<Terms>>> read_terms(const std::filesystem::path& folder,
                                                             const Problem& problem) {
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant,
                            physics::load_plant(folder / "plant_improved.toml"));
  std::shared_ptr<Arm> arm;
  if (plant.joints.size() == 3) {
    arm = std::make_shared<Arm>(Arm{plant, {}});
    for (std::size_t i = 0; i < 3; ++i) arm->positions[i] = position_of(plant.joints[i].name);
  }
  std::vector<std::unique_ptr<Terms>> all;
  for (const model::OutputSpec& output : problem.outputs) {
    const auto index = plant.joint_index(output.joint);
    if (!index)
      return core::data_error(fmt::format("{}: has no joint {}", plant.source, output.joint));
    const physics::Joint& joint = plant.joints[*index];
    std::optional<physics::CableReplay> cable;
    const physics::CableNumbers numbers = physics::cable_numbers(joint);
    if (numbers.compliance > 0.0) cable.emplace(numbers);
    all.push_back(std::make_unique<JointTerms>(position_of(output.joint), parts_of(plant, joint),
                                               cable, cable ? arm : nullptr, *index));
  }
  return all;
}

}  // namespace ravencal::methods
