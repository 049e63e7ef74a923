// SPDX-License-Identifier: Apache-2.0
//
// The plugin inside a control loop: the digital twin under joint control whose desired positions
// are set to the measured ones in each cycle in which the pedal is not down, as the RAVEN-II
// controller does.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/run_level.hpp"
#include "physics/plant.hpp"
#include "physics/raven_controller.hpp"
#include "physics/raven_twin.hpp"
#include "plugin_host/robot_state.hpp"
#include "rt/rig.hpp"
#include "rt/witness.hpp"

namespace ravencal::test {

using Eigen::Vector3d;

enum class Plugin { kNone, kBothWays, kForwardOnly };

inline constexpr float kFollowShare = 0.1F;  // the plugin's default
inline constexpr double kDeg = std::numbers::pi / 180.0;
inline constexpr double kCountRad = 2.0 * std::numbers::pi / 4000.0;  // of a motor's encoder

using core::RunLevel;
using enum core::RunLevel;

/// Corrections as large as the authors' robot needs them (7.5 deg, 10.5 mm between the zeros of
/// controller and external encoders), changing with the joints' positions.
inline model::CalibrationModel make_large_correction() {
  model::CalibrationModel model =
      make_model({plain("jpos.shoulder"), plain("jpos.elbow"), plain("jpos.insertion")}, {});
  model.input.mean = Vector3d(0.7, 1.4, 0.38);
  model.input.scale = Vector3d(0.7, 0.8, 0.15);
  model.input_min = model.input.mean - model.input.scale;
  model.input_max = model.input.mean + model.input.scale;
  model.layers[0].weights << 1.0F, 0.5F, 0.2F, -0.5F, 1.0F, 0.3F, 0.3F, 0.4F, 1.0F;
  model.layers[0].biases.setZero();
  model.output.mean = Vector3d(0.02, -0.131, 0.0105);
  model.output.scale = Vector3d(0.01, 0.01, 0.001);
  return model;
}

class ControlledTwin {
 public:
  explicit ControlledTwin(Plugin plugin,
                          const model::CalibrationModel& model = make_large_correction(),
                          float follow_share = kFollowShare)
      : plugin_(plugin),
        rig_([&](ravencal_config& config) { config.follow_share = follow_share; }),
        plant_(*physics::load_plant(RAVENCAL_SOURCE_DIR "/tools/plants/raven2.toml")),
        twin_(std::move(physics::RavenTwin::create(plant_, 1)).value()),
        witness_(rig_.config, Witness::Desired::kPublished) {
    rig_.load(model);
    rig_.enable(plugin != Plugin::kNone);
    home();
  }

  /// Runs the homing sequence; the controller's own, in which the plugin only watches.
  void home() {
    rig_.state.runlevel = kInit;
    for (ravencal_arm& arm : rig_.state.arm) arm.joints_ready = 0;
    twin_.home([&] {
      rig_.state.t_ns = twin_.t_ns();
      step_plugin();
      see(rig_.state);
    });
    has_command_ = false;  // homing sets the zeros anew
  }

  /// So many cycles at this run level, moving if the pedal is down.
  void run(RunLevel level, int cycles) {
    level_ = level;
    for (int i = 0; i < cycles; ++i) cycle();
  }

  /// Pedal down without a command.
  void stand(int cycles) {
    commands_ = false;
    run(kPedalDown, cycles);
    commands_ = true;
  }

  /// From here on nobody commands.
  void let_go() { commands_ = false; }

  [[nodiscard]] Vector3d truth_ji() const { return twin_.truth().encoder_ji; }
  /// Fastest of the true joints over 50 ms, and of the desired ones, since forget_speeds().
  [[nodiscard]] const Vector3d& peak_true_ji_per_s() const { return peak_true_ji_per_s_; }
  [[nodiscard]] const Vector3d& peak_commanded_ji_per_s() const { return peak_commanded_ji_per_s_; }
  void forget_speeds() {
    peak_true_ji_per_s_ = peak_commanded_ji_per_s_ = Vector3d::Zero();
    window_cycles_ = 0;
  }
  [[nodiscard]] const Vector3d& largest_steps_rad() const { return largest_steps_rad_; }
  /// How far a motor's command was from the motor when it was set to where that is.
  [[nodiscard]] double furthest_seed_rad() const { return furthest_seed_rad_; }
  [[nodiscard]] const std::string& wrong() const { return wrong_; }
  [[nodiscard]] std::int32_t state() const { return rig_.output.state; }
  [[nodiscard]] double correction_ji(int joint) const {
    return static_cast<double>(rig_.output.correction_ji[joint]);
  }
  [[nodiscard]] Rig& rig() { return rig_; }
  /// One cycle in which the weights of make_model_with_a_flaw fail.
  void provoke() {
    provokes_ = true;
    cycle();
    provokes_ = false;
  }
  /// How far the correction moved motor commands while the pedal was down: most in a cycle, and in
  /// all, since forget_added().
  [[nodiscard]] double most_added_counts() const { return most_added_counts_; }
  [[nodiscard]] double added_counts() const { return added_counts_; }
  void forget_added() { most_added_counts_ = added_counts_ = 0.0; }

 private:
  /// The operator: leads the arm around, to the same places with the plugin and without, as fast
  /// as the authors' follower (2.182 deg/s, 3 deg/s, 5 mm/s) and as closely.
  Vector3d velocity_ji_per_s() {
    const double t_s = static_cast<double>(moving_cycles_++) * 1e-3;
    const auto there_and_back = [&](double period_s) {
      return std::abs(std::fmod(t_s / period_s, 1.0) - 0.5) * 2.0;  // 1, 0, 1
    };
    const Vector3d fastest(0.03808, 0.05236, 0.005);
    const Vector3d place(0.5 + 0.04 * there_and_back(2.3), 1.5 + 0.04 * there_and_back(1.7),
                         0.39 + 0.003 * there_and_back(1.3));
    const Vector3d uncorrected =
        Eigen::Map<Eigen::Vector3f>(rig_.state.arm[0].jpos_ji).cast<double>();
    return (4.0 * (place - uncorrected)).cwiseMin(fastest).cwiseMax(-fastest);
  }

  void step_plugin() { rig_.api().step(rig_.instance.get(), &rig_.state, &rig_.output); }

  void see(const ravencal_state& state) {
    const std::string wrong = witness_.see(state, rig_.output);
    if (wrong_.empty()) wrong_ = wrong;
  }

  void cycle() {
    const std::int64_t published_t_ns = twin_.t_ns();
    plugin_host::fill_state(plugin_host::to_si(twin_.begin_cycle()), published_t_ns, true,
                            rig_.state);
    rig_.state.runlevel = level_;
    if (provokes_) provoke_flaw(rig_.state);
    step_plugin();
    const Vector3d measured = Eigen::Map<Eigen::Vector3f>(rig_.output.jpos_ji).cast<double>();
    const bool seed = level_ != kPedalDown;
    if (seed) desired_ji_ = measured;
    if (level_ == kPedalDown && commands_) desired_ji_ += 1e-3 * velocity_ji_per_s();
    note_speeds();
    Vector3d commanded_ji = desired_ji_;
    if (plugin_ == Plugin::kBothWays) {
      const Eigen::Vector3f desired = desired_ji_.cast<float>();
      Eigen::Vector3f uncorrected;
      rig_.api().uncorrect_desired(rig_.instance.get(), desired.data(), uncorrected.data());
      commanded_ji = uncorrected.cast<double>();
    }
    const Vector3d command_rad = physics::motors_from_joints(plant_, commanded_ji);
    note_command(command_rad);
    note_added(commanded_ji, command_rad);
    if (seed) {
      const Vector3d motors_rad =
          Eigen::Map<Eigen::Vector3f>(rig_.state.arm[0].mpos_rad).cast<double>();
      const double apart_rad = (command_rad - motors_rad).cwiseAbs().maxCoeff();
      furthest_seed_rad_ = std::max(furthest_seed_rad_, apart_rad);
    }
    ravencal_state seen = rig_.state;
    plugin_host::fill_state(plugin_host::to_si(twin_.end_cycle(commanded_ji)), twin_.t_ns(), true,
                            rig_.state);
    rig_.state.t_ns = published_t_ns;
    rig_.state.runlevel = level_;
    rig_.api().observe_cycle_end(rig_.instance.get(), &rig_.state);
    std::copy_n(rig_.state.arm[0].jpos_d_ji, RAVENCAL_JOINTS, seen.arm[0].jpos_d_ji);
    see(seen);
  }

  void note_speeds() {
    constexpr int kWindowCycles = 50;
    if (window_cycles_++ % kWindowCycles != 0) return;
    const Vector3d truth = truth_ji();
    if (window_cycles_ > 1) {
      const double per_s = 1.0 / (1e-3 * kWindowCycles);
      peak_true_ji_per_s_ =
          peak_true_ji_per_s_.cwiseMax((truth - truth_before_ji_).cwiseAbs() * per_s);
      peak_commanded_ji_per_s_ =
          peak_commanded_ji_per_s_.cwiseMax((desired_ji_ - desired_before_ji_).cwiseAbs() * per_s);
    }
    truth_before_ji_ = truth;
    desired_before_ji_ = desired_ji_;
  }

  /// Against the command of this cycle with the correction of the cycle before.
  void note_added(const Vector3d& commanded_ji, const Vector3d& command_rad) {
    const Vector3d correction_ji =
        Eigen::Map<Eigen::Vector3f>(rig_.output.correction_ji).cast<double>();
    const Vector3d change_ji = correction_ji - std::exchange(correction_before_ji_, correction_ji);
    if (level_ != kPedalDown) return;
    const Vector3d without_rad = physics::motors_from_joints(plant_, commanded_ji + change_ji);
    const double counts = (command_rad - without_rad).cwiseAbs().maxCoeff() / kCountRad;
    most_added_counts_ = std::max(most_added_counts_, counts);
    added_counts_ += counts;
  }

  void note_command(const Vector3d& command_rad) {
    if (has_command_) {
      largest_steps_rad_ = largest_steps_rad_.cwiseMax((command_rad - command_rad_).cwiseAbs());
    }
    command_rad_ = command_rad;
    has_command_ = true;
  }

  Plugin plugin_;
  Rig rig_;
  physics::Plant plant_;
  physics::RavenTwin twin_;
  Witness witness_;
  std::string wrong_;
  RunLevel level_ = kInit;
  Vector3d desired_ji_ = Vector3d::Zero();
  int moving_cycles_ = 0;
  bool commands_ = true;
  int window_cycles_ = 0;
  Vector3d truth_before_ji_ = Vector3d::Zero();
  Vector3d desired_before_ji_ = Vector3d::Zero();
  Vector3d peak_true_ji_per_s_ = Vector3d::Zero();
  Vector3d peak_commanded_ji_per_s_ = Vector3d::Zero();
  Vector3d command_rad_ = Vector3d::Zero();
  bool has_command_ = false;
  Vector3d largest_steps_rad_ = Vector3d::Zero();
  double furthest_seed_rad_ = 0.0;
  bool provokes_ = false;
  Vector3d correction_before_ji_ = Vector3d::Zero();
  double most_added_counts_ = 0.0;
  double added_counts_ = 0.0;
};

}  // namespace ravencal::test
