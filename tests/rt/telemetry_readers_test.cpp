// SPDX-License-Identifier: Apache-2.0
//
// Readers of the loaded plugin's telemetry, of which any may stop or die, as may the writer: no
// other process notices.
#include <grp.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/ipc.h>
#include <sys/shm.h>

#include <fstream>
#include <numeric>
#include <optional>

#include "monitor/telemetry_follower.hpp"
#include "rt/telemetry_process.hpp"
#include "rt/telemetry_rig.hpp"
#include "unit/telemetry_segment.hpp"

namespace ravencal::test {
namespace {

using monitor::Change;
using monitor::NumberedTick;
using monitor::TelemetryReader;
using monitor::Writer;

ravencal_telemetry_label label_of(const std::string& name) {
  ravencal_telemetry_label label{};
  std::ifstream("/dev/shm" + name, std::ios::binary)
      .read(reinterpret_cast<char*>(&label), sizeof label);
  return label;
}

TEST(Telemetry, CannotBeWrittenByAReader) {
  const std::string name = telemetry_name("readonly");
  Rig rig;
  ASSERT_TRUE(give_telemetry(rig, name).ok());
  void* const memory = ::shmat(label_of(name).memory_id, nullptr, SHM_RDONLY);
  ASSERT_NE(memory, reinterpret_cast<void*>(-1));
  ChildProcess vandal([&]() -> int {
    ::signal(SIGSEGV, SIG_DFL);
    *static_cast<volatile char*>(memory) = 'X';
    return 0;
  });
  const int status = vandal.wait();
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGSEGV);
  EXPECT_EQ(*static_cast<char*>(memory), RAVENCAL_TELEMETRY_MAGIC[0]);
  ::shmdt(memory);
}

TEST(Telemetry, IsReadByItsGroupAndByNobodyElse) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become other users";
  const std::string name = telemetry_name("group");
  Rig rig;
  ASSERT_TRUE(give_telemetry(rig, name).ok());
  const int id = label_of(name).memory_id;
  const auto attaches_as = [&](gid_t group, int flags) {
    ChildProcess other([&]() -> int {
      if (::setgroups(0, nullptr) != 0 || ::setgid(group) != 0 || ::setuid(54321) != 0) return 9;
      return ::shmat(id, nullptr, flags) == reinterpret_cast<void*>(-1) ? 0 : 1;
    });
    return WEXITSTATUS(other.wait());
  };
  EXPECT_EQ(attaches_as(::getegid(), SHM_RDONLY), 1);
  EXPECT_EQ(attaches_as(::getegid(), 0), 0) << "to write";
  EXPECT_EQ(attaches_as(54321, SHM_RDONLY), 0);
}

int read_for_ever(const std::string& name) {
  TelemetryReader reader = opened(name);
  std::vector<NumberedTick> ticks;
  for (;;) {
    ticks.clear();
    reader.read(ticks);
    (void)reader.counters();
    (void)reader.writer();
  }
}

TEST(Telemetry, NoticesNeitherStoppedNorKilledReaders) {
  const std::string name = telemetry_name("readers");
  Rig with;
  ASSERT_TRUE(give_telemetry(with, name).ok());
  Rig without;
  for (Rig* rig : {&with, &without}) {
    rig->load(make_model(16, {8}));
    rig->enable();
  }
  ChildProcess stopped([&] { return read_for_ever(name); });
  ChildProcess killed([&] { return read_for_ever(name); });
  std::mt19937 random(6);
  for (int i = 0; i < 200'000; ++i) {
    if (i == 50'000) {
      stopped.signal(SIGSTOP);
      stopped.wait_until_stopped();
    }
    if (i == 100'000) {
      killed.signal(SIGKILL);
      killed.wait();
    }
    disturb(with.state, random, i);
    without.state = with.state;
    ASSERT_EQ(with.tick(), without.tick());
    ASSERT_TRUE(same_output(with.output, without.output)) << i;
  }
  EXPECT_EQ(with.instance.counters().ticks, 200'000U);
  TelemetryReader reader = opened(name);
  std::vector<NumberedTick> ticks;
  reader.read(ticks);
  EXPECT_EQ(ticks.back().number, 199'999U);
  EXPECT_EQ(ticks.size(), RAVENCAL_TELEMETRY_SLOTS * 7U / 8U) << "the ring is whole";
  EXPECT_EQ(reader.writer(), Writer::kAlive) << "readers that died took no lock with them";
}

TEST(Telemetry, ShowsNoTornTickInMillionsAtFullSpeed) {
  const std::string name = telemetry_name("speed");
  const auto made = [](std::uint64_t number, ravencal_state& state) {
    const auto low = static_cast<std::int32_t>(number % 8'388'608);
    for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
      state.arm[0].jpos_ji[j] = static_cast<float>(low + j);
      state.arm[0].enc_counts[j] = low * (j + 1);
    }
    state.runlevel = low;
  };
  ChildProcess writer([&]() -> int {
    Rig rig;
    if (!give_telemetry(rig, name).ok()) return 1;
    for (std::uint64_t number = 0;; ++number) {
      made(number, rig.state);
      rig.state.t_ns = static_cast<std::int64_t>(number);
      rig.api().step(rig.instance.get(), &rig.state, &rig.output);
    }
  });
  while (!TelemetryReader::open(name).ok()) ::usleep(1000);
  TelemetryReader reader = opened(name);
  ravencal_state wanted{};
  std::vector<NumberedTick> ticks;
  std::uint64_t seen = 0;
  std::uint64_t torn = 0;
  std::uint64_t reads = 0;
  std::uint64_t counters_read = 0;
  std::uint64_t counters_torn = 0;
  while (seen < 2'000'000 || counters_read == 0) {
    ticks.clear();
    reader.read(ticks);
    if (ticks.empty()) ::sched_yield();  // the writer may need this processor
    for (const NumberedTick& numbered : ticks) {
      const ravencal_tick& tick = numbered.tick;
      made(numbered.number, wanted);
      const bool whole =
          tick.tick == numbered.number + 1 &&
          tick.t_ns == static_cast<std::int64_t>(numbered.number) &&
          tick.runlevel == wanted.runlevel &&
          std::memcmp(tick.jpos_ji, wanted.arm[0].jpos_ji, sizeof tick.jpos_ji) == 0 &&
          std::memcmp(tick.enc_counts, wanted.arm[0].enc_counts, sizeof tick.enc_counts) == 0;
      ++seen;
      torn += whole ? 0 : 1;
    }
    // Rarely: a writer without a pause leaves hardly a moment in which all of them stand still.
    const auto counters = ++reads % 1000 == 0 ? reader.counters() : std::nullopt;
    if (counters) {
      ++counters_read;
      const std::uint64_t sum =
          std::accumulate(std::begin(counters->ticks_in_state), std::end(counters->ticks_in_state),
                          std::uint64_t{0});
      counters_torn += sum == counters->ticks ? 0 : 1;
    }
  }
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(counters_torn, 0U);
  RecordProperty("ticks_seen", std::to_string(seen));
  RecordProperty("ticks_written", std::to_string(reader.next()));
  writer.signal(SIGKILL);
  writer.wait();
  EXPECT_EQ(reader.writer(), Writer::kGone);
}

TEST(Telemetry, IsFollowedOverTheDeathAndTheReturnOfItsWriter) {
  const std::string name = telemetry_name("returns");
  const auto work = [&]() -> int {
    Rig rig;
    if (!give_telemetry(rig, name).ok()) return 1;
    for (;;) {
      rig.tick();
      ::usleep(100);
    }
  };
  auto writer = std::make_unique<ChildProcess>(work);
  while (!TelemetryReader::open(name).ok()) ::usleep(1000);
  monitor::TelemetryFollower follower(opened(name));
  std::vector<NumberedTick> ticks;
  while (ticks.size() < 100) EXPECT_EQ(follower.poll(ticks), Change::kNone);
  writer->signal(SIGKILL);
  writer->wait();
  EXPECT_EQ(follower.poll(ticks), Change::kGone);
  const std::uint32_t dead = follower.reader().writer_pid();
  EXPECT_EQ(follower.poll(ticks), Change::kNone);
  writer = std::make_unique<ChildProcess>(work);
  Change change = Change::kNone;
  while (change == Change::kNone) change = follower.poll(ticks);
  EXPECT_EQ(change, Change::kAttached);
  EXPECT_NE(follower.reader().writer_pid(), dead);
  ticks.clear();
  while (ticks.empty()) EXPECT_EQ(follower.poll(ticks), Change::kNone);
  EXPECT_EQ(ticks[0].number, 0U) << "from its first tick on";
}

}  // namespace
}  // namespace ravencal::test
