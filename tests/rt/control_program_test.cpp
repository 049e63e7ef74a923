// SPDX-License-Identifier: Apache-2.0
//
// What `ravencal control` says and how it ends where the loop stands, the pedal stays down, another
// program asks too, or plugin and user do not belong together.

#include <functional>
#include <vector>

#include "rt/control_rig.hpp"

namespace ravencal::test {
namespace {

using control::Answer;

class ControlProgram : public ControlRig {
 protected:
  void expect_end(const Ended& ended, int code, const std::string& says) {
    EXPECT_EQ(ended.code, code) << ended.text;
    EXPECT_NE(ended.text.find(says), std::string::npos) << ended.text;
  }
  /// What was said not to be taken is not taken later.
  void expect_withdrawn() {
    const std::uint64_t before = taken();
    rig.set_pedal(false);
    expect_state(RAVENCAL_STATE_SHADOW, 500);
    EXPECT_EQ(taken(), before);
  }
};

TEST_F(ControlProgram, SaysThatTheLoopStandsAndLeavesNothing) {
  for (const bool is_down : {false, true}) {
    rig.set_pedal(is_down);
    expect_end(call_control("arm --wait-s 0.2 --name " + name), 3, "the control loop stands");
    expect_withdrawn();
  }
}

TEST_F(ControlProgram, LeavesWhatWaitsForThePedalUnlessItWaitsItself) {
  rig.set_pedal(true);
  expect_end(call("arm --wait-s 0.2 --name " + name), 1, "not taken within 0.2 s");
  expect_withdrawn();
  rig.set_pedal(true);
  expect_end(call("arm --name " + name), 0, "the pedal is down; it is taken when that is up");
  expect_end(call("share 10 --name " + name), 1, "an earlier request waits");
  rig.set_pedal(false);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
}

TEST_F(ControlProgram, IsNotShutOutByWhatThePluginNeverTakes) {
  ravencal_request strange = newer(RAVENCAL_REQUEST_ARM);
  for (const std::uint32_t version : {0U, 2U}) {
    strange.version = version;
    write_words(memory, checked(strange));
    for (int i = 0; i < 10; ++i) rig.tick();
    expect_end(call("arm --name " + name), 0, "arm: taken");
    expect_end(call("shadow --name " + name), 0, "shadow: taken");
    strange.number = newer(RAVENCAL_REQUEST_ARM).number;
  }
  strange = newer(RAVENCAL_REQUEST_KINDS);
  write_words(memory, strange);
  expect_end(call("arm --name " + name), 0, "arm: taken");
  strange = newer(RAVENCAL_REQUEST_SHARE);
  strange.share = 2.0F;
  write_words(memory, checked(strange));
  expect_end(call("share 50 --name " + name), 0, "share: taken");
}

// Two programs may tear each other's requests. "off" has to get through.
TEST_F(ControlProgram, OffGetsThroughBesideOtherPrograms) {
  std::atomic<bool> ends{false};
  std::vector<std::thread> others;
  for (int i = 0; i < 3; ++i) {
    others.emplace_back([&, i] {
      const control::Request share{RAVENCAL_REQUEST_SHARE, 0.25F * static_cast<float>(i), 7};
      while (!ends) {
        (void)control::ask(name, share, 0.2, [&] { return !ends; });
        ::usleep(20'000);
      }
    });
  }
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(ask({RAVENCAL_REQUEST_OFF, 1.0F, 7}, 2.0), Answer::kTaken) << i;
    EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
    rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_SHADOW);
    EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_SHADOW));
  }
  ends = true;
  for (std::thread& other : others) other.join();
}

TEST_F(ControlProgram, OffWithoutANameReachesEveryPluginOfThisUser) {
  Rig second;
  ASSERT_TRUE(give_telemetry(second, telemetry_name("second")).ok());
  second.load(make_model(16, {}));
  second.enable();
  ASSERT_TRUE(second.tick_until(RAVENCAL_STATE_ACTIVE));
  std::atomic<bool> done{false};
  std::thread loop([&] {
    while (!done) {
      second.tick();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  });
  const Ended ended = call("off");
  done = true;
  loop.join();
  expect_end(ended, 0, name + ": off: taken");
  expect_end(ended, 0, telemetry_name("second") + ": off: taken");
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
  EXPECT_TRUE(second.tick_until(RAVENCAL_STATE_OFF));
  // One that stands keeps no other from being switched off.
  rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_SHADOW);
  const Ended one_stands = call("off --wait-s 0.3");
  expect_end(one_stands, 3, name + ": off: taken");
  expect_end(one_stands, 3, telemetry_name("second") + ": ");
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

TEST_F(ControlProgram, NamesWhatThereIsAndSaysWhereThereIsNothing) {
  for (const char* what : {"arm", "shadow", "reset", "share 10"}) {
    expect_end(call_control(what), 2, "needs --name; there are: " + name);
  }
  rig.instance = {};
  expect_end(call_control("off"), 3, "no controller with telemetry");
  expect_end(call_control("arm"), 2, "there is none of this user");
  expect_end(call_control("arm --name " + name), 3, "no telemetry of that name");
}

TEST_F(ControlProgram, SaysThatTheControllerEnded) {
  const std::string other = telemetry_name("ends");
  ChildProcess controller([&]() -> int {
    Rig own;
    if (!give_telemetry(own, other).ok()) return 1;
    own.state.runlevel = core::kPedalDown;
    for (;;) {
      own.tick();
      ::usleep(1000);
    }
  });
  while (::access(("/dev/shm" + other).c_str(), F_OK) != 0) ::usleep(1000);
  std::thread killer([&] {
    // Long enough for the program to see the controller, on a busy machine too.
    ::usleep(2'000'000);
    controller.signal(SIGKILL);
    controller.wait();
  });
  expect_end(call_control("arm --wait-s 20 --name " + other), 3, "has ended");
  killer.join();
  expect_end(call_control("arm --name " + other), 3, "was killed or crashed");
}

constexpr uid_t kNobody = 65534;

/// Ends the child with what went wrong, or 0.
int as_nobody(bool keeps_group, const std::function<int()>& work) {
  ChildProcess other([&]() -> int {
    if (!keeps_group && ::setgid(kNobody) != 0) return 100;
    return ::setuid(kNobody) != 0 ? 100 : work();
  });
  const int status = other.wait();
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(ControlProgram, RefusesAnotherUserByASentence) {
  if (::geteuid() != 0) GTEST_SKIP() << "to become another user takes root";
  const int id = opened(name).request_id();
  for (const bool keeps_group : {false, true}) {  // the group may watch, and nothing else
    EXPECT_EQ(as_nobody(keeps_group,
                        [&]() -> int {
                          if (attached(id) != nullptr) return 1;
                          const Ended ended = call_control("arm --name " + name);
                          if (ended.code != 3) return 2;
                          if (ended.text.find("of another user") == std::string::npos) return 3;
                          return call_control("off").code == 3 ? 0 : 4;
                        }),
              0)
        << keeps_group;
  }
  expect_state(RAVENCAL_STATE_SHADOW);
}

TEST_F(ControlProgram, RefusesRootThePluginOfAnother) {
  if (::geteuid() != 0) GTEST_SKIP() << "to become another user takes root";
  const std::string other = telemetry_name("others");
  ChildProcess controller([&]() -> int {
    if (::setgid(kNobody) != 0 || ::setuid(kNobody) != 0) return 1;
    Rig own;
    if (!give_telemetry(own, other).ok()) return 2;
    for (;;) {
      own.tick();
      ::usleep(1000);
    }
  });
  for (int i = 0; i < 5000 && ::access(("/dev/shm" + other).c_str(), F_OK) != 0; ++i) {
    ::usleep(1000);
  }
  expect_end(call_control("arm --name " + other), 3, "of another user");
  const Ended ended = call("off");
  expect_end(ended, 0, name + ": off: taken");
  EXPECT_EQ(ended.text.find(other), std::string::npos) << "not root's own";
}

// A label of one's own may name memory of another program of this user: that is not written to.
TEST_F(ControlProgram, WritesToNoMemoryThatIsNoPlugins) {
  const int foreign_id = ::shmget(IPC_PRIVATE, sizeof(ravencal_request), IPC_CREAT | 0600);
  std::uint64_t* const foreign = attached(foreign_id);
  ASSERT_NE(foreign, nullptr);
  TelemetrySegment segment(telemetry_name("foreign"));
  segment.header().label.request_id = foreign_id;
  segment.write_label();
  segment.write();
  expect_end(call_control("arm --wait-s 0.2 --name " + telemetry_name("foreign")), 3,
             "is no plugin's");
  for (std::size_t i = 0; i < kRequestWords; ++i) EXPECT_EQ(foreign[i], 0U);
  ::shmctl(foreign_id, IPC_RMID, nullptr);
  ::shmdt(foreign);
}

}  // namespace
}  // namespace ravencal::test
