// SPDX-License-Identifier: Apache-2.0
//
// What programs ask the plugin for: modes, shares and a reset, by whom, when, and what is none of
// it. The control loop runs in a thread of the test.
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "rt/control_rig.hpp"

namespace ravencal::test {
namespace {

using control::Answer;

class Control : public ControlRig {};

TEST_F(Control, TakesEveryKindOfRequest) {
  EXPECT_EQ(ask(RAVENCAL_REQUEST_ARM), Answer::kTaken);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  EXPECT_EQ(ask({RAVENCAL_REQUEST_SHARE, 0.1F, 2}), Answer::kTaken);
  for (int i = 0; i < 500; ++i) rig.tick();
  EXPECT_NEAR(rig.output.correction_ji[1], 0.1F * rig.output.predicted_ji[1], 1e-7);
  EXPECT_EQ(rig.output.correction_ji[0], 0.0F);
  EXPECT_EQ(ask(RAVENCAL_REQUEST_SHADOW), Answer::kTaken);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_SHADOW));
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));

  rig.load(make_model_with_a_flaw());
  EXPECT_EQ(ask(RAVENCAL_REQUEST_SHADOW), Answer::kTaken);
  for (int i = 0; i < 500; ++i) rig.tick();
  provoke_flaw(rig.state);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FAULT));
  EXPECT_EQ(ask(RAVENCAL_REQUEST_RESET), Answer::kTaken);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

TEST_F(Control, TakesNothingButOffAndResetWithThePedalDown) {
  rig.set_pedal(true);
  EXPECT_EQ(ask({RAVENCAL_REQUEST_ARM, 1.0F, 7}, 0.2), Answer::kWaitsForPedal);
  expect_state(RAVENCAL_STATE_SHADOW);
  EXPECT_EQ(ask({RAVENCAL_REQUEST_SHARE, 0.1F, 7}), Answer::kOtherWaits) << "or that is lost";
  rig.set_pedal(false);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE)) << "it lay there until the pedal was up";
  rig.set_pedal(true);
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
  const auto before = std::to_array(rig.output.correction_ji);
  for (int i = 0; i < 300; ++i) rig.tick();
  EXPECT_EQ(std::to_array(rig.output.correction_ji), before) << "it stays until the pedal is up";
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_OUT);
  rig.set_pedal(false);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

TEST_F(Control, SaysThatNobodyTookItWhereTheLoopStands) {
  const auto answer = control::ask(name, {RAVENCAL_REQUEST_ARM, 1.0F, 7}, 0.1, [] { return true; });
  ASSERT_TRUE(answer.ok()) << answer.error().message;
  EXPECT_EQ(answer.value(), Answer::kStands);
}

TEST_F(Control, IsForTheUserOfTheControlProcessAlone) {
  if (::geteuid() != 0) GTEST_SKIP() << "to become another user takes root";
  const int id = opened(name).request_id();
  ChildProcess other([&]() -> int {
    constexpr uid_t kNobody = 65534;
    if (::setgid(kNobody) != 0 || ::setuid(kNobody) != 0) return 2;
    const bool found = !control::own_names().empty();
    const auto answer =
        control::ask(name, {RAVENCAL_REQUEST_ARM, 1.0F, 7}, 0.1, [] { return true; });
    const bool attached = ::shmat(id, nullptr, 0) != reinterpret_cast<void*>(-1);
    return !found && !answer.ok() && !attached ? 0 : 1;
  });
  EXPECT_EQ(other.wait(), 0);
  expect_state(RAVENCAL_STATE_SHADOW);
}

TEST_F(Control, EndsAsTheProgramSays) {
  struct Case {
    std::string arguments;
    int code;
    const char* says;
  };
  std::atomic<bool> ends{false};
  std::thread loop([&] {
    while (!ends) {
      rig.tick();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  });
  for (const Case& one :
       {Case{"arm", 2, "'arm' needs --name; there are: "},
        Case{"share --name " + name, 2, "share needs a percentage"},
        Case{"arm 10 --name " + name, 2, "'arm' takes no percentage"},
        Case{"share 10 --joints wrist --name " + name, 2, "'wrist' is none of"},
        Case{"share 101 --name " + name, 2, "percent"},
        Case{"arm --name /ravencal-none", 3, "no telemetry of that name"},
        Case{"share 50 --joints elbow --name " + name, 0, "share: taken"},
        Case{"arm --name " + name, 0, "arm: taken"}, Case{"off", 0, "off: taken"}}) {
    const Ended ended = call_control(one.arguments);
    EXPECT_EQ(ended.code, one.code) << one.arguments << "\n" << ended.text;
    EXPECT_NE(ended.text.find(one.says), std::string::npos) << one.arguments << "\n" << ended.text;
  }
  ends = true;
  loop.join();
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
  const Ended stands = call_control("arm --wait-s 0.1 --name " + name);
  EXPECT_EQ(stands.code, 3) << stands.text;
  EXPECT_NE(stands.text.find("the control loop stands"), std::string::npos) << stands.text;
}

}  // namespace
}  // namespace ravencal::test
