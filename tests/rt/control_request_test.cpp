// SPDX-License-Identifier: Apache-2.0
//
// What the plugin takes from its memory for requests, and what it leaves: every damage, at every
// moment, by programs that are stale, killed or many. What it took shows in request_taken, whatever
// the state hides.
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "core/run_level.hpp"
#include "rt/control_rig.hpp"
#include "rt/instruction_count.hpp"

namespace ravencal::test {
namespace {

using control::Answer;

class ControlRequests : public ControlRig {
 protected:
  /// A request that is no request: the correction goes on, and the number of the last one stays.
  void expect_ignored(const ravencal_request& request, const std::string& what) {
    const std::uint64_t before = taken();
    const auto correction_ji = std::to_array(rig.output.correction_ji);
    write_words(memory, request);
    for (int i = 0; i < 20; ++i) rig.tick();
    EXPECT_EQ(taken(), before) << what;
    EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE) << what;
    EXPECT_EQ(std::to_array(rig.output.correction_ji), correction_ji) << what;
  }
  void arm() {
    ASSERT_EQ(ask(RAVENCAL_REQUEST_ARM), Answer::kTaken);
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
    for (int i = 0; i < 500; ++i) rig.tick();
  }
};

// Each of them would end the correction or change its share, if it were taken.
TEST_F(ControlRequests, LeavesWhatIsDamaged) {
  arm();
  const ravencal_request off = newer(RAVENCAL_REQUEST_OFF);
  for (int bit = 0; bit < 256; ++bit) {
    auto words = std::bit_cast<RequestWords>(off);
    words[static_cast<std::size_t>(bit / 64)] ^= std::uint64_t{1} << (bit % 64);
    expect_ignored(std::bit_cast<ravencal_request>(words), "bit " + std::to_string(bit));
  }
  for (const std::uint32_t version : {0U, 2U, 0xFFFFFFFFU}) {
    expect_ignored(checked({off.number, version, off.kind, 1.0F, 7, 0}), "another version");
  }
  for (const std::uint32_t kind : {RAVENCAL_REQUEST_KINDS, 0x80000000U, 0xFFFFFFFFU}) {
    expect_ignored(checked({off.number, off.version, kind, 1.0F, 7, 0}), "another kind");
  }
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float share : {-0.1F, 1.0001F, kInfinity, -kInfinity, kNan}) {
    expect_ignored(checked({off.number, off.version, RAVENCAL_REQUEST_SHARE, share, 7, 0}),
                   "share " + std::to_string(share));
  }
  for (const std::uint32_t joints : {8U, 0xFFFFFFFFU}) {
    expect_ignored(checked({off.number, off.version, RAVENCAL_REQUEST_SHARE, 0.5F, joints, 0}),
                   "joints that are none");
  }
  expect_ignored({}, "zeros");
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken) << "nothing of that shuts a program out";
}

TEST_F(ControlRequests, LeavesWordsByChance) {
  const std::uint64_t before = taken();
  std::mt19937_64 random(3);
  for (int i = 0; i < 10'000; ++i) {
    for (std::size_t word = 0; word < kRequestWords; ++word) memory[word] = random();
    rig.tick();
    ASSERT_EQ(rig.output.state, RAVENCAL_STATE_SHADOW);
  }
  EXPECT_EQ(taken(), before);
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken) << "nothing of that shuts a program out";
}

TEST_F(ControlRequests, LeavesNumbersOfThePastAndTheLargest) {
  arm();
  const auto start = static_cast<std::uint64_t>(opened(name).start_realtime_ns());
  for (const std::uint64_t number :
       {std::uint64_t{0}, std::uint64_t{1}, start - 1, start, taken() - 1, taken(),
        std::numeric_limits<std::uint64_t>::max()}) {
    expect_ignored(checked({number, RAVENCAL_REQUEST_VERSION, RAVENCAL_REQUEST_OFF, 1.0F, 7, 0}),
                   "number " + std::to_string(number));
  }
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
}

TEST_F(ControlRequests, NumberThatIsFarAheadIsTakenAndShutsNobodyOut) {
  ravencal_request request = newer(RAVENCAL_REQUEST_ARM);
  request.number += std::numeric_limits<std::int64_t>::max() / 2;
  write_words(memory, checked(request));
  for (int i = 0; i < 10; ++i) rig.tick();
  ASSERT_EQ(taken(), request.number);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

// Who asked for it did not know that the robot would stop.
TEST_F(ControlRequests, ToArmAfterAnEmergencyStopNeedsAnotherRequest) {
  for (const bool resumes : {false, true}) {
    rig.config.resume_after_stop = resumes ? 1 : 0;
    start();
    rig.set_pedal(true);
    const ravencal_request request = newer(RAVENCAL_REQUEST_ARM);
    write_words(memory, request);
    expect_state(RAVENCAL_STATE_SHADOW);
    ASSERT_NE(taken(), request.number) << "the pedal is down";
    rig.state.runlevel = core::kEmergencyStop;
    for (int i = 0; i < 50; ++i) rig.tick();
    rig.state.runlevel = core::kPedalUp;
    for (int i = 0; i < 3000; ++i) rig.tick();
    EXPECT_EQ(taken(), request.number);
    EXPECT_EQ(rig.output.state, resumes ? RAVENCAL_STATE_ACTIVE : RAVENCAL_STATE_SHADOW);
    EXPECT_EQ(rig.output.correction_ji[1] != 0.0F, resumes);
  }
}

// A program that is killed between two of its stores, over a request that still waits.
TEST_F(ControlRequests, HalfARequestIsNoneAndTakesTheWaitingOneWithIt) {
  constexpr std::array<std::size_t, kRequestWords> kOrder = {1, 2, 3, 0};
  for (std::size_t stores = 1; stores < kRequestWords; ++stores) {
    rig.set_pedal(true);
    write_words(memory, newer(RAVENCAL_REQUEST_ARM));
    rig.tick();
    ravencal_request share = newer(RAVENCAL_REQUEST_SHARE);
    share.share = 0.25F;
    share.joints = 2;
    share.number += 1;
    const auto words = std::bit_cast<RequestWords>(checked(share));
    for (std::size_t i = 0; i < stores; ++i) memory[kOrder[i]] = words[kOrder[i]];
    const std::uint64_t before = taken();
    expect_state(RAVENCAL_STATE_SHADOW);
    rig.set_pedal(false);
    expect_state(RAVENCAL_STATE_SHADOW, 500);
    EXPECT_EQ(taken(), before) << stores;
  }
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
}

TEST_F(ControlRequests, ProgramsKilledAtAnyMomentLeaveWholeRequestsOrNone) {
  arm();
  std::mt19937 random(7);
  for (int i = 0; i < 100; ++i) {
    ChildProcess program([&]() -> int {
      for (std::uint64_t number = opened(name).request_taken();;) {
        number += 1000;
        const bool is_whole = number / 1000 % 2 == 0;
        write_words(memory, checked({number, RAVENCAL_REQUEST_VERSION, RAVENCAL_REQUEST_SHARE,
                                     is_whole ? 1.0F : 0.5F, is_whole ? 7U : 2U, 0}));
      }
    });
    const std::uint32_t ticks = random() % 20 + 1;
    for (std::uint32_t tick = 0; tick < ticks; ++tick) {
      rig.tick();
      ::usleep(random() % 200);
    }
    program.signal(SIGKILL);
    program.wait();
    for (int tick = 0; tick < 500; ++tick) rig.tick();
    ASSERT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
    // Of all joints, or half of the elbow's: no mixture of the two.
    const bool is_whole = rig.output.correction_ji[0] != 0.0F;
    const float share = is_whole ? 1.0F : 0.5F;
    ASSERT_NEAR(rig.output.correction_ji[1], share * rig.output.predicted_ji[1], 1e-6F);
    ASSERT_EQ(rig.output.correction_ji[2] != 0.0F, is_whole);
  }
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

/// Requests at random, sound ones and others, as fast as they can be written; never ends.
int flood(const std::string& name, std::uint64_t* memory, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (std::uint64_t number = opened(name).request_taken();;) {
    number += random() % 4096;
    const auto kind = static_cast<std::uint32_t>(random() % (RAVENCAL_REQUEST_KINDS + 1));
    const float share = static_cast<float>(random() % 1200) / 1000.0F;
    write_words(memory, checked({number, RAVENCAL_REQUEST_VERSION, kind, share,
                                 static_cast<std::uint32_t>(random() % 9), 0}));
    // Two that never pause tear each other's requests: hardly one would be whole.
    if (random() % 64 == 0) ::usleep(100);
  }
}

TEST_F(ControlRequests, FloodsOfTwoProcessesLeaveTheStateConsistent) {
  ChildProcess first([&] { return flood(name, memory, 1); });
  ChildProcess second([&] { return flood(name, memory, 2); });
  constexpr int kTicks = 100'000;
  constexpr int kMostTicks = 100 * kTicks;  // where the machine leaves the others no time
  const auto reader = opened(name);
  std::uint64_t changes = 0;
  std::uint64_t before = reader.request_taken();
  for (int i = 0; i < kTicks || (changes < 1000 && i < kMostTicks); ++i) {
    if (i % 5000 == 4999) rig.set_pedal(i / 5000 % 2 == 0);
    rig.tick();
    ASSERT_GE(rig.output.state, 0);
    ASSERT_LT(rig.output.state, RAVENCAL_STATE_COUNT);
    const bool shows_only =
        rig.output.state == RAVENCAL_STATE_SHADOW || rig.output.state == RAVENCAL_STATE_OFF;
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      const float most_ji = shows_only ? 0.0F : rig.config.max_correction_ji[j];
      ASSERT_LE(std::abs(rig.output.correction_ji[j]), most_ji);
    }
    changes += reader.request_taken() != before ? 1 : 0;
    before = reader.request_taken();
  }
  EXPECT_GE(changes, 1000U) << "the flood did not reach the plugin";
  for (ChildProcess* one : {&first, &second}) {
    one->signal(SIGKILL);
    one->wait();
  }
  rig.set_pedal(false);
  EXPECT_EQ(ask(RAVENCAL_REQUEST_OFF), Answer::kTaken);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
}

// It has the memory of the plugin before, and its number.
TEST_F(ControlRequests, StaleProgramReachesNobody) {
  const int stale_id = opened(name).request_id();
  std::uint64_t* const stale = attached(stale_id);
  ASSERT_NE(stale, nullptr);
  start();
  ASSERT_NE(opened(name).request_id(), stale_id);
  const std::uint64_t before = taken();
  write_words(stale, newer(RAVENCAL_REQUEST_ARM));
  expect_state(RAVENCAL_STATE_SHADOW, 500);
  EXPECT_EQ(taken(), before);
  ::shmdt(stale);
  EXPECT_EQ(attached(stale_id), nullptr) << "the kernel has freed it";
  EXPECT_EQ(ask(RAVENCAL_REQUEST_ARM), Answer::kTaken) << "the name leads to the new one";
}

// In a copy of this process, which has no plugin of its parent: it makes its own.
TEST_F(ControlRequests, AStepTakesAFewInstructionsMoreWhateverLiesThere) {
  std::unique_ptr<Rig> own;
  std::uint64_t* asked = nullptr;
  constexpr int kKinds = 9;
  const char* const names[kKinds] = {"nothing", "off",  "arm",   "shadow", "share",
                                     "reset",   "half", "waits", "unknown"};
  const auto setup = [&](int i) {
    if (own == nullptr) {
      own = std::make_unique<Rig>();
      if (!give_telemetry(*own, telemetry_name("counted")).ok()) std::abort();
      own->load(make_model(16, {}));
      asked = attached(opened(own->config.telemetry_name).request_id());
    }
    own->set_pedal(false);
    own->enable();
    own->tick_until(RAVENCAL_STATE_ACTIVE);
    for (int tick = 0; tick < 10; ++tick) own->tick();
    const int kind = i % kKinds;
    if (kind == 7) own->set_pedal(true);
    const std::uint64_t number = opened(own->config.telemetry_name).request_taken() + 1000;
    ravencal_request request{number, RAVENCAL_REQUEST_VERSION, 0, 1.0F, 7, 0};
    request.kind = kind >= 1 && kind <= 5 ? static_cast<std::uint32_t>(kind - 1) : 1U;
    if (kind == 8) request.kind = RAVENCAL_REQUEST_KINDS;
    request = checked(request);
    if (kind == 6) request.check ^= 1U;
    if (kind != 0) write_words(asked, request);
    own->state.t_ns += 1'000'000;
  };
  const auto tick = [&](int) { own->api().step(own->instance.get(), &own->state, &own->output); };
  const auto counts = count_instructions(2 * kKinds, setup, tick);
  if (counts.empty()) GTEST_SKIP() << "tracing is not allowed here";
  for (int i = 0; i < 2 * kKinds; ++i) {
    EXPECT_NEAR(static_cast<double>(counts[static_cast<std::size_t>(i)]),
                static_cast<double>(counts[0]), 250.0)
        << names[i % kKinds];
  }
}

}  // namespace
}  // namespace ravencal::test
