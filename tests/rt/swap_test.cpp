// SPDX-License-Identifier: Apache-2.0
//
// New weights under a running loop: no step in the output, and no tick that waits or does more. A
// tick that waits for the loading thread would call the system, which ends the test; a tick that
// does more shows in its instructions. Time on a shared machine would show neither.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <limits>
#include <thread>

#include "core/run_level.hpp"
#include "rt/instruction_count.hpp"
#include "rt/rig.hpp"
#include "rt/system_call_alarm.hpp"
#include "rt/witness.hpp"

namespace ravencal::test {
namespace {

/// Four models that ask for different corrections.
std::vector<std::filesystem::path> write_four() {
  std::vector<std::filesystem::path> files;
  for (std::uint64_t i = 0; i < 4; ++i) {
    model::CalibrationModel model = make_model(16, {16}, i);
    model.output.mean *= i % 2 == 0 ? 1.0 : -1.0;
    files.push_back(write_weights(model, "swap" + std::to_string(i)));
  }
  return files;
}

/// Result of the child of the test below.
struct Report {
  std::uint64_t swaps = 0;
  std::uint64_t ticks = 0;
  std::array<char, 200> wrong{};
};

/// The real-time thread: ticks until told to stop. It may sleep between ticks, but a tick that
/// waits for anything else ends the process; so does the thread's own end, which is why it has
/// none.
[[noreturn]] void run_loop(Rig& rig, Report& report, const std::atomic<bool>& stop,
                           std::atomic<bool>& stopped) {
  Witness witness(rig.config);
  std::string wrong = forbid_system_calls(SYS_clock_nanosleep) ? "" : "no seccomp";
  const timespec pause{0, 50'000};
  while (!stop.load(std::memory_order_relaxed) && wrong.empty()) {
    rig.tick();
    wrong = witness.see(rig.state, rig.output);
    ++report.ticks;
    ::clock_nanosleep(CLOCK_MONOTONIC, 0, &pause, nullptr);
  }
  wrong.copy(report.wrong.data(), report.wrong.size() - 1);
  stopped = true;
  for (;;) ::clock_nanosleep(CLOCK_MONOTONIC, 0, &pause, nullptr);
}

/// Whatever time is left over goes into memory traffic.
void burn(const std::atomic<bool>& stop) {
  (void)::nice(19);  // of this thread alone, on Linux
  std::vector<char> memory(16U << 20U);
  for (char value = 0; !stop.load(std::memory_order_relaxed); ++value) {
    std::memset(memory.data(), value, memory.size());
  }
}

int swap_ten_thousand_times(const std::vector<std::filesystem::path>& files, Report& report) {
  constexpr std::uint64_t kSwaps = 10'000;
  Rig rig;
  rig.enable();
  std::atomic<bool> stop{false};
  std::atomic<bool> stopped{false};
  std::thread loop([&] { run_loop(rig, report, stop, stopped); });
  std::thread load([&] { burn(stop); });
  for (std::uint64_t swap = 1; swap <= kSwaps && !stopped; ++swap) {
    if (!rig.instance.load(files[swap % files.size()]).ok()) return 4;
    while (!stopped && rig.instance.counters().swaps < swap) ::usleep(20);
  }
  stop = true;
  while (!stopped) ::usleep(20);
  report.swaps = rig.instance.counters().swaps;
  ::_exit(0);  // ends the real-time thread, too
}

TEST(Swap, TenThousandUnderLoadMakeNoStepAndNoTickThatWaits) {
  void* const memory =
      ::mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  auto* const report = new (memory) Report{};
  const auto files = write_four();
  const ChildEnd end = run_in_child([&] { return swap_ten_thousand_times(files, *report); });
  EXPECT_FALSE(end.called_system);
  ASSERT_EQ(end.exit_code, 0);
  EXPECT_STREQ(report->wrong.data(), "");
  EXPECT_EQ(report->swaps, 10'000U);
  EXPECT_GT(report->ticks, 10'000U);
  ::munmap(memory, sizeof(Report));
}

// Ten kinds of tick, each twice. The network is small here, so that what does not belong to
// it would show; it takes most of the instructions all the same.
TEST(Tick, TakesTheSameInstructionsWhateverHappensInIt) {
  const auto sound = write_weights(make_model(16, {64}), "counted");
  const auto flawed = write_weights(make_model_with_a_flaw(), "counted_flaw");
  Rig rig;
  constexpr int kKinds = 10;
  const char* const names[kKinds] = {"plain",     "NaN",    "infinity", "denormals", "far out",
                                     "time jump", "E-stop", "encoder",  "swap",      "fault"};
  const auto setup = [&](int i) {
    rig.api().reset(rig.instance.get());
    (void)rig.instance.load(i % kKinds == 9 ? flawed : sound);
    rig.state = healthy_state(rig.state.t_ns);
    rig.tick();
    rig.enable();
    rig.tick_until(RAVENCAL_STATE_ACTIVE);
    rig.state.t_ns += 1'000'000;
    float(&jpos)[RAVENCAL_SLOTS] = rig.state.arm[0].jpos_ji;
    switch (i % kKinds) {
      case 1:
        std::fill(std::begin(jpos), std::end(jpos), std::numeric_limits<float>::quiet_NaN());
        break;
      case 2:
        std::fill(std::begin(jpos), std::end(jpos), std::numeric_limits<float>::infinity());
        break;
      case 3:
        std::fill(std::begin(jpos), std::end(jpos), std::numeric_limits<float>::denorm_min());
        break;
      case 4:
        std::fill(std::begin(jpos), std::end(jpos), -1e30F);
        break;
      case 5:
        rig.state.t_ns += 5'000'000'000;
        break;
      case 6:
        rig.state.runlevel = core::kEmergencyStop;
        break;
      case 7:
        rig.state.arm[0].enc_counts[0] += 1 << 24;
        break;
      case 8:
        (void)rig.instance.load(sound);
        break;
      case 9:
        provoke_flaw(rig.state);
        break;
      default:
        break;
    }
  };
  const auto tick = [&](int /*i*/) { rig.api().step(rig.instance.get(), &rig.state, &rig.output); };
  const auto counts = count_instructions(2 * kKinds, setup, tick);
  if (counts.empty()) GTEST_SKIP() << "tracing is not allowed here";
  for (int i = 0; i < 2 * kKinds; ++i) {
    if (i % kKinds == 9) continue;  // of another network: compared with itself below
    const std::uint64_t count = counts[static_cast<std::size_t>(i)];
    EXPECT_NEAR(static_cast<double>(count), static_cast<double>(counts[0]), 150.0)
        << names[i % kKinds];
  }
  EXPECT_NEAR(static_cast<double>(counts[9]), static_cast<double>(counts[19]), 150.0);
}

}  // namespace
}  // namespace ravencal::test
