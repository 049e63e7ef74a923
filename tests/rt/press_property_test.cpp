// SPDX-License-Identifier: Apache-2.0
//
// Off means off: whatever the host does with its desired joints, from 0 to 1 rad in one cycle, in
// any state and over many presses, emergency stops, homings and changes of mode, no correction
// comes from it.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

#include "core/run_level.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

using JointArray = std::array<float, RAVENCAL_JOINTS>;

bool is_at_rest(const ravencal_output& output) {
  return output.state == RAVENCAL_STATE_OFF || output.state == RAVENCAL_STATE_ARMED ||
         output.state == RAVENCAL_STATE_SHADOW || output.state == RAVENCAL_STATE_FAULT;
}

/// A controller whose inverse kinematics and clients do anything.
class AnyHost {
 public:
  explicit AnyHost(std::uint64_t seed)
      : random_(seed), rig_([](ravencal_config& config) { config.resume_after_stop = 0; }) {
    rig_.load(make_model(16, {}, seed));
    rig_.api().set_mode(rig_.instance.get(), RAVENCAL_MODE_ARM);
  }

  /// A few hundred cycles at one run level; returns what went wrong.
  std::string go(std::int32_t runlevel) {
    if (pick(3) == 0) change_something();
    rig_.state.runlevel = runlevel;
    for (int left = 1 + pick(300); left > 0; --left) {
      const std::string wrong = cycle();
      if (!wrong.empty()) return wrong;
    }
    return {};
  }
  /// The mode is off and the pedal is up for half a second: nothing is left.
  std::string end() {
    rig_.enable(false);
    rig_.state = healthy_state(rig_.state.t_ns);
    moves_ = true;
    for (int i = 0; i < 520; ++i) {
      const std::string wrong = cycle();
      if (!wrong.empty()) return wrong;
    }
    return rig_.output.state == RAVENCAL_STATE_OFF ? "" : "it is not off after half a second";
  }
  std::int32_t any_level() {
    constexpr std::array<std::int32_t, 8> kLevels = {
        core::kEmergencyStop, core::kInit,      core::kPedalUp,   core::kPedalUp,
        core::kPedalUp,       core::kPedalDown, core::kPedalDown, core::kPedalDown};
    return kLevels[static_cast<std::size_t>(pick(8))];
  }

 private:
  int pick(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  float jump_ji() { return 1e-3F * static_cast<float>(pick(2000) - 1000); }

  void change_something() {
    const auto mode = static_cast<std::int32_t>(pick(3));
    switch (pick(6)) {
      case 0:
        rig_.api().set_mode(rig_.instance.get(), mode);
        break;
      case 1:
        rig_.api().set_mode(rig_.instance.get(), RAVENCAL_MODE_ARM);
        break;
      case 2:
        rig_.api().set_share(rig_.instance.get(), 0.1F * static_cast<float>(pick(11)),
                             static_cast<std::uint32_t>(pick(8)));
        break;
      case 3:
        rig_.api().reset(rig_.instance.get());
        break;
      case 4:
        rig_.state = healthy_state(rig_.state.t_ns);
        rig_.state.arm[0].jpos_ji[pick(3)] += jump_ji();  // out of range, often
        break;
      default:
        moves_ = pick(4) != 0;
    }
  }

  std::string cycle() {
    const bool was_down = is_down_;
    is_down_ = rig_.state.runlevel == core::kPedalDown;
    const JointArray before_ji = std::to_array(rig_.output.correction_ji);
    if (is_down_ && pick(3) == 0) desired_ji_[pick(3)] += 1e-4F;  // a client's increment
    std::copy_n(desired_ji_.begin(), RAVENCAL_JOINTS, rig_.state.arm[0].jpos_d_ji);
    rig_.state.t_ns += rig_.config.tick_ns;
    rig_.api().step(rig_.instance.get(), &rig_.state, &rig_.output);
    const JointArray now_ji = std::to_array(rig_.output.correction_ji);
    if (moves_) desired_ji_ = std::to_array(rig_.output.desired_ji);
    write_desired(was_down);
    JointArray motor_ji{};
    rig_.api().uncorrect_command(rig_.instance.get(), desired_ji_.data(), pick(2), motor_ji.data());
    std::string wrong = look(before_ji, now_ji, motor_ji);
    observe();
    return wrong;
  }

  /// Between the hook and the inverse cable coupling.
  void write_desired(bool was_down) {
    const bool presses = is_down_ && !was_down;
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      if (!is_down_ && pick(4) != 0) desired_ji_[j] = rig_.output.jpos_ji[j];
      if (presses && pick(2) == 0) desired_ji_[j] += jump_ji();
    }
  }

  /// The published state has the desired joints without the correction.
  void observe() {
    rig_.api().uncorrect_desired(rig_.instance.get(), desired_ji_.data(),
                                 rig_.state.arm[0].jpos_d_ji);
    rig_.api().observe_cycle_end(rig_.instance.get(), &rig_.state);
  }

  std::string look(const JointArray& before_ji, const JointArray& now_ji,
                   const JointArray& motor_ji) {
    const ravencal_output& output = rig_.output;
    const bool is_init = rig_.state.runlevel == core::kInit;
    const bool only_shrinks = output.state == RAVENCAL_STATE_HOLD ||
                              output.state == RAVENCAL_STATE_FADING_OUT ||
                              output.state == RAVENCAL_STATE_CONSTANT;
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      if ((is_at_rest(output) || is_init) &&
          (now_ji[j] != 0.0F ||
           std::memcmp(&output.jpos_ji[j], &rig_.state.arm[0].jpos_ji[j], sizeof(float)) != 0 ||
           std::memcmp(&motor_ji[j], &desired_ji_[j], sizeof(float)) != 0)) {
        return "a correction at rest";
      }
      const bool grows =
          std::fabs(now_ji[j]) > std::fabs(before_ji[j]) || now_ji[j] * before_ji[j] < 0.0F;
      if (only_shrinks && grows) return "a correction grows where none may";
      // What this press took away is seen at the next hook.
      const bool taken = (output.doubts & RAVENCAL_DOUBT_PRESS) != 0 && !grows;
      if (is_down_ && only_shrinks && now_ji[j] != before_ji[j] && !taken) {
        return "a correction moves with the pedal down";
      }
    }
    const bool may_doubt = !moves_ || stubborn_ > 0;
    stubborn_ = !moves_ ? 2000 : std::max(0, stubborn_ - 1);
    if (!may_doubt && (output.doubts & RAVENCAL_DOUBT_PRESS) != 0) {
      return "a doubt about a host that moves its desired joints";
    }
    return {};
  }

  std::mt19937_64 random_;
  Rig rig_;
  JointArray desired_ji_{};
  bool moves_ = true;  ///< desired joints, as it is told to
  int stubborn_ = 0;   ///< cycles in which it may still be seen that it did not
  bool is_down_ = false;
};

RC_GTEST_PROP(PressProperty, NoPressMakesACorrectionWhateverTheHostCommands, ()) {
  AnyHost host(*rc::gen::arbitrary<std::uint64_t>());
  for (int i = 0; i < 50; ++i) {
    const std::string wrong = host.go(host.any_level());
    if (!wrong.empty()) RC_FAIL("segment " + std::to_string(i) + ": " + wrong);
  }
  const std::string wrong = host.end();
  if (!wrong.empty()) RC_FAIL(wrong);
}

}  // namespace
}  // namespace ravencal::test
