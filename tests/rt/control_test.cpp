// SPDX-License-Identifier: Apache-2.0
//
// What programs ask the plugin for: modes, shares and a reset, by whom, when, and what is none of
// it. The control loop runs in a thread of the test.
#include <gtest/gtest.h>
#include <sys/shm.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <thread>

#include "control/control.hpp"
#include "core/run_level.hpp"
#include "rt/telemetry_process.hpp"
#include "rt/telemetry_rig.hpp"
#include "unit/telemetry_segment.hpp"

namespace ravencal::test {
namespace {

using control::Answer;
constexpr std::size_t kWords = sizeof(ravencal_request) / sizeof(std::uint64_t);

class Control : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(give_telemetry(rig, name).ok());
    rig.load(make_model(16, {}));
    rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_SHADOW);
    for (int i = 0; i < 500; ++i) rig.tick();
    ASSERT_EQ(rig.output.state, RAVENCAL_STATE_SHADOW);
    memory = static_cast<std::uint64_t*>(::shmat(opened(name).request_id(), nullptr, 0));
    ASSERT_NE(memory, reinterpret_cast<std::uint64_t*>(-1));
  }
  void TearDown() override { ::shmdt(memory); }

  /// Asks while the loop runs; the loop ticks until the answer is there.
  Answer ask(const control::Request& request, double wait_s = 5.0) {
    std::atomic<bool> answered{false};
    Answer answer = Answer::kNotTaken;
    std::thread asker([&] {
      const auto result = control::ask(name, request, wait_s, [] { return true; });
      EXPECT_TRUE(result.ok()) << result.error().message;
      if (result.ok()) answer = result.value();
      answered = true;
    });
    while (!answered) {
      rig.tick();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    asker.join();
    return answer;
  }
  Answer ask(std::uint32_t kind) { return ask(control::Request{kind, 1.0F, 7}); }

  /// A request as control.h has it, changed by `damage` before its check is made and after.
  void write(ravencal_request request, bool has_check = true) {
    auto words = std::bit_cast<std::array<std::uint64_t, kWords>>(request);
    if (has_check) words[3] = RAVENCAL_REQUEST_CHECK(words[0], words[1], words[2]);
    for (std::size_t i = kWords; i-- > 0;) memory[i] = words[i];
  }
  [[nodiscard]] std::uint64_t newer() const { return opened(name).request_taken() + 1'000'000; }
  void expect_shadow_goes_on() {
    for (int i = 0; i < 50; ++i) {
      rig.tick();
      ASSERT_EQ(rig.output.state, RAVENCAL_STATE_SHADOW);
    }
  }

  const std::string name = telemetry_name("control");
  Rig rig;
  std::uint64_t* memory = nullptr;
};

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
  expect_shadow_goes_on();
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

TEST_F(Control, IgnoresWhatIsNoRequest) {
  const ravencal_request arm{newer(), RAVENCAL_REQUEST_VERSION, RAVENCAL_REQUEST_ARM, 1.0F, 7, 0};
  ravencal_request changed = arm;
  write(changed, false);  // half of one, or none at all
  expect_shadow_goes_on();
  changed.version = 2;
  write(changed);
  expect_shadow_goes_on();
  changed = arm;
  changed.kind = RAVENCAL_REQUEST_KINDS;
  write(changed);
  expect_shadow_goes_on();
  for (const float share : {-0.1F, 1.1F, std::numeric_limits<float>::quiet_NaN()}) {
    changed = {arm.number + 1, RAVENCAL_REQUEST_VERSION, RAVENCAL_REQUEST_SHARE, share, 7, 0};
    write(changed);
    expect_shadow_goes_on();
  }
  changed = arm;
  changed.number = static_cast<std::uint64_t>(opened(name).start_realtime_ns()) - 1;
  write(changed);  // of a program that is older than the plugin
  expect_shadow_goes_on();
  std::mt19937_64 random(3);
  for (int i = 0; i < 10'000; ++i) {
    for (std::size_t word = 0; word < kWords; ++word) memory[word] = random();
    rig.tick();
    ASSERT_EQ(rig.output.state, RAVENCAL_STATE_SHADOW);
  }
  // Nothing of that shuts a program out.
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
}

TEST_F(Control, NumberFarAheadShutsNobodyOut) {
  write({std::numeric_limits<std::uint64_t>::max(), RAVENCAL_REQUEST_VERSION,
         RAVENCAL_REQUEST_SHADOW, 1.0F, 7, 0});
  for (int i = 0; i < 10; ++i) rig.tick();
  EXPECT_EQ(ask(RAVENCAL_REQUEST_ARM), Answer::kTaken);
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

TEST_F(Control, StandsAFloodOfRequests) {
  std::atomic<bool> ends{false};
  std::thread flood([&] {
    std::uint64_t number = newer();
    while (!ends) {
      number += 1'000;
      write({number, RAVENCAL_REQUEST_VERSION,
             static_cast<std::uint32_t>(number / 1'000 % RAVENCAL_REQUEST_KINDS), 0.5F, 7, 0});
    }
  });
  for (int i = 0; i < 100'000; ++i) {
    rig.tick();
    ASSERT_LT(rig.output.state, RAVENCAL_STATE_COUNT);
    if (rig.output.state != RAVENCAL_STATE_SHADOW) continue;
    for (const float correction : rig.output.correction_ji) ASSERT_EQ(correction, 0.0F);
  }
  ends = true;
  flood.join();
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

TEST_F(Control, HearsNothingOfAProgramThatWasKilledWhileItWrote) {
  const auto words = std::bit_cast<std::array<std::uint64_t, kWords>>(
      ravencal_request{newer(), RAVENCAL_REQUEST_VERSION, RAVENCAL_REQUEST_ARM, 1.0F, 7, 0});
  for (std::size_t written = 1; written < kWords; ++written) {
    ChildProcess program([&]() -> int {
      for (std::size_t i = 1; i <= written && i < kWords; ++i) memory[i] = words[i];
      if (written == kWords - 1) memory[0] = words[0];  // the number, without a check
      ::raise(SIGKILL);
      return 0;
    });
    program.wait();
    expect_shadow_goes_on();
  }
}

TEST_F(Control, SaysThatNobodyTookItWhereTheLoopStands) {
  const auto answer = control::ask(name, {RAVENCAL_REQUEST_ARM, 1.0F, 7}, 0.1, [] { return true; });
  ASSERT_TRUE(answer.ok()) << answer.error().message;
  EXPECT_EQ(answer.value(), Answer::kNotTaken);
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
  expect_shadow_goes_on();
}

/// The program, as a user types it.
struct Ended {
  int code = -1;
  std::string text;
};
Ended call(const std::string& arguments) {
  const std::string command = std::string(RAVENCAL_PROGRAM) + " control " + arguments + " 2>&1";
  FILE* const pipe = ::popen(command.c_str(), "r");
  Ended ended;
  std::array<char, 256> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) ended.text += part.data();
  const int status = ::pclose(pipe);
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ended;
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
    const Ended ended = call(one.arguments);
    EXPECT_EQ(ended.code, one.code) << one.arguments << "\n" << ended.text;
    EXPECT_NE(ended.text.find(one.says), std::string::npos) << one.arguments << "\n" << ended.text;
  }
  ends = true;
  loop.join();
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
  const Ended stands = call("arm --wait-s 0.1 --name " + name);
  EXPECT_EQ(stands.code, 1) << stands.text;
  EXPECT_NE(stands.text.find("not taken within 0.1 s"), std::string::npos) << stands.text;
}

}  // namespace
}  // namespace ravencal::test
