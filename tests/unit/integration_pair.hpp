// SPDX-License-Identifier: Apache-2.0
//
// Two look-alike controllers side by side, one with the plugin and one without, that get the same
// commands: whatever their true joints do differently, the plugin did.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "unit/integration_rig.hpp"

namespace ravencal::test {

/// Errors as large as a RAVEN-II's: 1.2 deg, -6.9 deg, 9 mm.
inline model::CalibrationModel model_of_offsets(bool green) {
  model::CalibrationModel model = model_for_home(green);
  model.output.mean = Eigen::Vector3d(0.021, -0.120, 0.009);
  return model;
}

using Joints = std::array<double, 3>;  ///< rad, rad, m

/// What a press did beyond what it does without the plugin.
struct Added {
  Joints moved_ji{};             ///< true joints, at the worst moment
  Joints command_step_counts{};  ///< of the motors' desired positions, from one cycle to the next

  /// Of a motor's command, by the controller itself: it holds poses in whole micrometres, and
  /// either run rounds another pose. The nearer to the remote centre, the more.
  double rounding_counts = 0.0;

  /// Within 0.02 deg or 0.02 mm, and a count.
  [[nodiscard]] bool is_nothing() const {
    return moved_ji[0] <= 0.02 * kDeg && moved_ji[1] <= 0.02 * kDeg && moved_ji[2] <= 2e-5 &&
           *std::max_element(command_step_counts.begin(), command_step_counts.end()) <=
               1.0 + rounding_counts;
  }
  static constexpr double kDeg = 3.14159265358979 / 180.0;
};

inline std::ostream& operator<<(std::ostream& out, const Added& added) {
  return out << added.moved_ji[0] / Added::kDeg << " deg, " << added.moved_ji[1] / Added::kDeg
             << " deg, " << added.moved_ji[2] * 1e3 << " mm; command steps "
             << added.command_step_counts[0] << ", " << added.command_step_counts[1] << ", "
             << added.command_step_counts[2] << " counts";
}

class Pair {
 public:
  Pair(const controller_api& api, const controller_setup& with, const controller_setup& without)
      : api_(api), with_(api, with), without_(api, without) {
    each([&](controller* c) { api_.command(c, 0); });
  }

  template <typename Act>
  void each(const Act& act) {
    act(with_.get());
    act(without_.get());
  }
  void run(int level, int cycles) {
    for (int i = 0; i < cycles; ++i) {
      each([&](controller* c) { api_.cycle(c, level); });
    }
  }
  void press(bool down) {
    each([&](controller* c) { api_.press(c, down ? 1 : 0); });
  }
  void stream(int arms, std::array<float, 3> step_ji = {}) {
    each([&](controller* c) { api_.command_joints(c, arms, step_ji.data()); });
  }
  void move_by_hand(int other, std::array<float, 3> by_ji) {
    each([&](controller* c) { api_.move_by_hand(c, other, by_ji.data()); });
  }
  void home() {
    run(kEmergencyStop, 20);
    each([&](controller* c) { api_.begin_homing(c); });
    run(kEmergencyStop, 5);
    run(kInit, 2500);
  }
  /// The run without the plugin goes on from where the other one is.
  void adopt() { api_.adopt(without_.get(), with_.get()); }

  /// The PLC shows the pedal down for so many cycles in which nobody commands the joints.
  Added watch(int cycles, int level = kPedalDown) {
    Added added;
    const std::array<Joints, 2> start = {joints(with_.get()), joints(without_.get())};
    const double distance_m = std::max(0.013, std::fabs(insertion_m() - 0.47));
    added.rounding_counts = 2.0 * std::sqrt(3.0) * 1e-6 / distance_m * kReduction[0] / kRadPerCount;
    std::array<Joints, 2> command = {commands(with_.get()), commands(without_.get())};
    for (int i = 0; i < cycles; ++i) {
      run(level, 1);
      const std::array<Joints, 2> now = {joints(with_.get()), joints(without_.get())};
      const std::array<Joints, 2> next = {commands(with_.get()), commands(without_.get())};
      for (std::size_t j = 0; j < 3; ++j) {
        const double own = now[0][j] - start[0][j];
        raise(added.moved_ji[j], least(own, own - (now[1][j] - start[1][j])));
        const double step = next[0][j] - command[0][j];
        raise(added.command_step_counts[j],
              least(step, step - (next[1][j] - command[1][j])) / kRadPerCount);
      }
      command = next;
    }
    return added;
  }

  [[nodiscard]] Controller& with() { return with_; }
  [[nodiscard]] Controller& without() { return without_; }

 private:
  /// As measured without a correction.
  [[nodiscard]] double insertion_m() const {
    std::array<float, 3> jpos{};
    std::array<float, 3> jpos_d{};
    api_.joints(without_.get(), jpos.data(), jpos_d.data());
    return static_cast<double>(jpos[2]);
  }
  /// A motion that stays away with the plugin, such as one back into the limits, is not added.
  static double least(double a, double b) { return std::fabs(a) < std::fabs(b) ? a : b; }
  static void raise(double& worst, double value) { worst = std::max(worst, std::fabs(value)); }
  [[nodiscard]] Joints joints(controller* c) const {
    std::array<float, 3> motor{};
    api_.true_motors(c, motor.data());
    return {static_cast<double>(motor[0]) / kReduction[0],
            static_cast<double>(motor[1]) / kReduction[1],
            static_cast<double>(motor[2]) / kReduction[2]};
  }
  [[nodiscard]] Joints commands(controller* c) const {
    std::array<float, 3> mpos{};
    std::array<float, 3> mpos_d{};
    api_.motors(c, mpos.data(), mpos_d.data());
    return {static_cast<double>(mpos_d[0]), static_cast<double>(mpos_d[1]),
            static_cast<double>(mpos_d[2])};
  }

  const controller_api& api_;
  Controller with_;
  Controller without_;
};

}  // namespace ravencal::test
