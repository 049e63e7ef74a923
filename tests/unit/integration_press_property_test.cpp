// SPDX-License-Identifier: Apache-2.0
//
// Random operation of the look-alike controllers: pedal, latency of the PLC, emergency stops,
// homing, commands, tools moved by hand, weights and enabling. Whenever the pedal is down and
// nobody commands the joints, the true ones move as they do without the plugin.
// RAVENCAL_PRESS_SEQUENCES: how many sequences, for a long run.
#include <rapidcheck/gtest.h>

#include <random>
#include <sstream>

#include "unit/integration_pair.hpp"

namespace ravencal::test {
namespace {

class RandomOperation {
 public:
  RandomOperation(const Case& which, std::uint64_t seed)
      : api_(*which.entry()),
        random_(seed),
        weights_{write_weights(model_of_offsets(which.green != 0), "press_offsets"),
                 write_weights(model_for_home(which.green != 0), "press_home")},
        pair_(api_,
              {CONTROLLER_WITH, RAVENCAL_PLUGIN_PATH, weights_[0].c_str(), nullptr, which.green, 0,
               0, 0, 0, 500000000U, 0},
              {CONTROLLER_WITHOUT, nullptr, nullptr, nullptr, which.green, 0, 0, 0, 0, 0, 0}) {
    log_ << which.name << ", seed " << seed << ":";
    pair_.home();
    pair_.run(kPedalUp, 5);
  }

  /// One thing that happens between two presses, or a press. False: it moved the arm.
  bool next() {
    switch (pick(12)) {
      case 0:
        note("enable", pick(2));
        api_.enable(pair_.with().get(), last_);
        break;
      case 1:
        note("weights", pick(2));
        api_.load(pair_.with().get(), weights_[static_cast<std::size_t>(last_)].c_str());
        break;
      case 2:
        emergency_stop();
        break;
      case 3:
        return soft_stop();
      case 4:
        note("hand", pick(2));
        pair_.move_by_hand(last_, reachable());
        break;
      case 5:
        note("stream", pick(4));
        pair_.stream(last_);
        break;
      case 6:
        note("re-home", 0);
        pair_.press(false);
        pair_.stream(0);
        pair_.home();
        offset_ = {};
        level_ = kInit;
        break;
      case 7:
        note("wait", pick(700));
        pair_.run(level_, last_);
        break;
      default:
        return press();
    }
    return true;
  }
  [[nodiscard]] std::string log() const { return log_.str(); }
  [[nodiscard]] std::uint64_t press_doubts() { return doubts_; }
  [[nodiscard]] const Added& worst() const { return worst_; }

 private:
  int pick(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  void note(const char* what, int value) {
    last_ = value;
    log_ << ' ' << what << ' ' << value << ';';
  }

  /// Home, near a limit, at and beside the remote centre: where an arm may be put by hand.
  std::array<float, 3> reachable() {
    const std::array<float, 3> to = {0.02F * static_cast<float>(pick(50)) - 0.45F,
                                     0.03F * static_cast<float>(pick(50)) - 0.76F,
                                     0.004F * static_cast<float>(pick(40)) - 0.03F};
    std::array<float, 3> by{};
    auto& offset = offset_[static_cast<std::size_t>(last_)];
    for (std::size_t j = 0; j < 3; ++j) by[j] = to[j] - offset[j];
    offset = to;
    return by;
  }

  void emergency_stop() {
    note("E-stop", pick(1200));
    pair_.run(kEmergencyStop, 4 + last_);
    note("INIT", pick(60));
    pair_.run(kInit, 4 + last_);
    level_ = kPedalUp;
    note("up", pick(2) == 0 ? pick(8) : pick(300));
    pair_.run(level_, last_);
  }

  bool soft_stop() {
    note("soft stop", pick(300));
    pair_.each([&](controller* c) { api_.soft_stop(c); });
    pair_.run(level_, last_);
    emergency_stop();
    return true;
  }

  bool press() {
    note("press, PLC ms", pick(2) == 0 ? pick(10) : pick(200));
    pair_.press(true);
    pair_.run(level_ == kInit ? kPedalUp : level_, 1 + last_);
    note("watch", 5 + pick(400));
    const Added added = pair_.watch(last_);
    for (std::size_t j = 0; j < 3; ++j) {
      worst_.moved_ji[j] = std::max(worst_.moved_ji[j], added.moved_ji[j]);
      worst_.command_step_counts[j] =
          std::max(worst_.command_step_counts[j], added.command_step_counts[j]);
    }
    if ((pair_.with().output().doubts & RAVENCAL_DOUBT_PRESS) != 0) {
      ++doubts_;
      log_ << " doubted";
    }
    if (!added.is_nothing()) {
      log_ << " added " << added;
      return false;
    }
    if (pick(2) == 0) {
      note("command", pick(400));
      command(last_);
    }
    note("release", pick(2));  // 1: the PLC hears of it later
    if (last_ == 0) pair_.press(false);
    pair_.run(kPedalUp, 6);
    pair_.press(false);
    level_ = kPedalUp;
    return true;
  }

  /// The operator moves the arm. Then both runs go on from the same joints: the same command is
  /// another motion of the joints where the kinematics are corrected.
  void command(int cycles) {
    const std::array<int, 3> tip = {pick(7) - 3, pick(7) - 3, pick(7) - 3};
    pair_.each([&](controller* c) { api_.command_tip(c, tip.data()); });
    pair_.run(kPedalDown, cycles);
    const std::array<int, 3> none{};
    pair_.each([&](controller* c) { api_.command_tip(c, none.data()); });
    pair_.run(kPedalDown, 150);
    pair_.adopt();
  }

  const controller_api& api_;
  std::mt19937_64 random_;
  std::array<std::filesystem::path, 2> weights_;
  Pair pair_;
  std::ostringstream log_;
  std::array<std::array<float, 3>, 2> offset_{};  ///< of the arms, from home, by hand
  int level_ = kPedalUp;
  int last_ = 0;
  std::uint64_t doubts_ = 0;
  Added worst_;
};

RC_GTEST_PROP(IntegrationPressProperty, APressMovesTheArmAsItDoesWithoutThePluginWhateverCameBefore,
              ()) {
  const std::array<Case, 4> cases = {
      Case{"main_gold", controller_main_98, 0}, Case{"main_green", controller_main_17, 1},
      Case{"crtk_gold", controller_crtk_98, 0}, Case{"crtk_green", controller_crtk_17, 1}};
  const auto seed = *rc::gen::noShrink(rc::gen::arbitrary<std::uint64_t>());
  RandomOperation operation(cases[*rc::gen::inRange<std::size_t>(0, cases.size())], seed);
  for (int i = 0; i < 40; ++i) {
    if (!operation.next()) RC_FAIL(operation.log());
  }
  // Held by construction: the last line had nothing to do.
  if (operation.press_doubts() != 0) RC_FAIL("a doubt about a press: " + operation.log());
}

}  // namespace
}  // namespace ravencal::test
