// SPDX-License-Identifier: Apache-2.0
//
// The telemetry of the loaded plugin: what it says, whom it refuses, and that nobody who watches
// can change anything.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <numeric>
#include <random>
#include <sstream>
#include <vector>

#include "monitor/telemetry_reader.hpp"
#include "rt/telemetry_process.hpp"
#include "rt/telemetry_rig.hpp"
#include "unit/telemetry_segment.hpp"

namespace ravencal::test {
namespace {

using monitor::NumberedTick;
using monitor::TelemetryReader;
using monitor::Writer;

TEST(Telemetry, SaysOfEveryTickWhatTheHostSaw) {
  const std::string name = telemetry_name("says");
  Rig rig;
  ASSERT_TRUE(give_telemetry(rig, name).ok());
  rig.load(make_model(16, {32}));
  rig.enable();
  TelemetryReader reader = opened(name);
  EXPECT_EQ(reader.writer_pid(), static_cast<std::uint32_t>(::getpid()));
  EXPECT_EQ(reader.tick_ns(), 1'000'000U);
  EXPECT_STREQ(reader.plugin_version().c_str(), rig.api().version());
  std::mt19937 random(3);
  std::vector<NumberedTick> ticks;
  std::uint64_t number = 0;
  for (int round = 0; round < 3000; ++round) {
    disturb(rig.state, random, round);
    rig.tick();
    ticks.clear();
    reader.read(ticks);
    ASSERT_EQ(ticks.size(), 1U);
    EXPECT_EQ(ticks[0].number, number++);
    const ravencal_tick& tick = ticks[0].tick;
    EXPECT_EQ(tick.tick, number);
    EXPECT_EQ(tick.t_ns, rig.state.t_ns);
    EXPECT_EQ(std::memcmp(tick.jpos_ji, rig.state.arm[0].jpos_ji, sizeof tick.jpos_ji), 0);
    EXPECT_EQ(std::memcmp(tick.correction_ji, rig.output.correction_ji, sizeof tick.jpos_ji), 0);
    EXPECT_EQ(std::memcmp(tick.predicted_ji, rig.output.predicted_ji, sizeof tick.jpos_ji), 0);
    EXPECT_EQ(std::memcmp(tick.enc_counts, rig.state.arm[0].enc_counts, sizeof tick.enc_counts), 0);
    EXPECT_EQ(tick.runlevel, rig.state.runlevel);
    EXPECT_EQ(tick.state, rig.output.state);
    EXPECT_EQ(tick.doubts, rig.output.doubts);
    EXPECT_EQ(tick.confidence, rig.output.confidence);
    EXPECT_EQ(tick.step_ns, rig.output.step_ns);
  }
}

TEST(Telemetry, CountsAsThePluginDoesAndItsCountersAddUp) {
  const std::string name = telemetry_name("counts");
  Rig rig;
  ASSERT_TRUE(give_telemetry(rig, name).ok());
  rig.load(make_model(16, {}));
  const TelemetryReader reader = opened(name);
  std::mt19937 random(4);
  for (int i = 0; i < 20'000; ++i) {
    rig.enable(i / 1000 % 2 == 0);
    disturb(rig.state, random, i);
    rig.tick();
    if (i % 37 != 0) continue;
    const auto shown = reader.counters();
    ASSERT_TRUE(shown.has_value());
    const ravencal_counters own = rig.instance.counters();
    EXPECT_EQ(shown->ticks, static_cast<std::uint64_t>(i) + 1);
    EXPECT_EQ(std::accumulate(std::begin(shown->ticks_in_state), std::end(shown->ticks_in_state),
                              std::uint64_t{0}),
              shown->ticks);
    // All but the reserved word is the plugin's own block.
    EXPECT_EQ(
        std::memcmp(&shown->ticks, &own.ticks, sizeof own - offsetof(ravencal_counters, ticks)), 0);
  }
  EXPECT_GT(reader.counters()->transitions, 30U);
}

/// The segment that the file at `path` names, as the kernel lists it.
struct Memory {
  unsigned mode = 0;
  std::size_t bytes = 0;
  std::size_t resident_bytes = 0;
};
Memory memory_of(const std::string& path) {
  ravencal_telemetry_label label{};
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(&label), sizeof label);
  std::ifstream list("/proc/sysvipc/shm");
  std::string line;
  std::getline(list, line);
  while (std::getline(list, line)) {
    std::istringstream words(line);
    const std::vector<std::string> row{std::istream_iterator<std::string>(words), {}};
    if (std::stoi(row[1]) != label.memory_id) continue;
    return {static_cast<unsigned>(std::stoul(row[2], nullptr, 8)), std::stoul(row[3]),
            std::stoul(row[14])};
  }
  return {};
}

TEST(Telemetry, IsThereFromCreateToDestroyForItsGroupOnly) {
  const std::string name = telemetry_name("file");
  const std::string path = "/dev/shm" + name;
  struct stat status {};
  const mode_t before = ::umask(0);
  {
    Rig rig;
    ASSERT_TRUE(give_telemetry(rig, name).ok());
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777, 0640U);
    const Memory memory = memory_of(path);
    EXPECT_EQ(memory.mode & 0777U, 0640U);
    EXPECT_EQ(memory.bytes, RAVENCAL_TELEMETRY_HEADER_BYTES +
                                RAVENCAL_TELEMETRY_SLOTS * sizeof(ravencal_telemetry_slot));
    EXPECT_EQ(memory.resident_bytes, memory.bytes) << "every page before the first tick";
  }
  ::umask(before);
  EXPECT_NE(::stat(path.c_str(), &status), 0);
}

TEST(Telemetry, RefusesANameThatALiveProcessWrites) {
  const std::string name = telemetry_name("live");
  Rig first;
  ASSERT_TRUE(give_telemetry(first, name).ok());
  first.load(make_model(16, {}));
  Rig second;
  const core::Status refused = give_telemetry(second, name);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("another process writes it"), std::string::npos);
  ChildProcess other([&] {
    Rig third;
    return give_telemetry(third, name).ok() ? 0 : 7;
  });
  EXPECT_EQ(WEXITSTATUS(other.wait()), 7);
  TelemetryReader reader = opened(name);
  first.tick();
  std::vector<NumberedTick> ticks;
  reader.read(ticks);
  EXPECT_EQ(ticks.size(), 1U) << "the first one goes on";
}

TEST(Telemetry, ReplacesWhatADeadWriterLeftButNothingElse) {
  const std::string name = telemetry_name("dead");
  ChildProcess writer([&]() -> int {
    Rig rig;
    if (!give_telemetry(rig, name).ok()) return 1;
    ::raise(SIGKILL);
    return 2;
  });
  EXPECT_EQ(WTERMSIG(writer.wait()), SIGKILL);
  const auto dead = TelemetryReader::open(name);
  ASSERT_FALSE(dead.ok());
  EXPECT_NE(dead.error().message.find("was killed or crashed"), std::string::npos)
      << dead.error().message;
  Rig rig;
  EXPECT_TRUE(give_telemetry(rig, name).ok());
  EXPECT_EQ(opened(name).writer(), Writer::kAlive);

  const std::string foreign = telemetry_name("foreign");
  std::ofstream("/dev/shm" + foreign) << "something that others need";
  Rig other;
  EXPECT_FALSE(give_telemetry(other, foreign).ok());
  std::string kept;
  std::getline(std::ifstream("/dev/shm" + foreign) >> std::ws, kept);
  EXPECT_EQ(kept, "something that others need");
}

TEST(Telemetry, IsLeftOutWhereAStrangerHasItsName) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make files of other users";
  const std::string name = telemetry_name("stranger");
  TelemetrySegment theirs(name);
  ASSERT_EQ(::chown(("/dev/shm" + name).c_str(), 54321, 0), 0);
  Rig rig;
  const core::Status created = give_telemetry(rig, name);
  ASSERT_TRUE(created.ok()) << created.error().message;
  EXPECT_TRUE(plugin_host::is_without_telemetry(rig.config));
  rig.load(make_model(16, {}));
  rig.enable();
  const auto before = theirs.header().written;
  for (int i = 0; i < 100; ++i) rig.tick();
  EXPECT_EQ(theirs.header().written, before);
}

TEST(Telemetry, RefusesWhatIsNoName) {
  Rig rig;
  for (const char* name : {"x", "/", "/a/b", "/../x", "/.x", "ravencal-left"}) {
    EXPECT_FALSE(give_telemetry(rig, name).ok()) << name;
    std::memset(rig.config.telemetry_name, 0, sizeof rig.config.telemetry_name);
  }
  std::memset(rig.config.telemetry_name, 'x', sizeof rig.config.telemetry_name);
  rig.config.telemetry_name[0] = '/';
  EXPECT_FALSE(plugin_host::Instance::create(rig.library, rig.config).ok()) << "without its end";
}

TEST(Telemetry, ChangesNoBitOfTheOutput) {
  Rig with;
  ASSERT_TRUE(give_telemetry(with, telemetry_name("bits")).ok());
  Rig without;
  const model::CalibrationModel model = make_model(16, {64, 64});
  for (Rig* rig : {&with, &without}) {
    rig->load(model);
    rig->enable();
  }
  std::mt19937 random(5);
  for (int i = 0; i < 50'000; ++i) {
    disturb(with.state, random, i);
    without.state = with.state;
    ASSERT_EQ(with.tick(), without.tick());
    ASSERT_TRUE(same_output(with.output, without.output)) << i;
  }
  EXPECT_GT(with.instance.counters().ticks_in_state[RAVENCAL_STATE_ACTIVE], 1000U);
}

}  // namespace
}  // namespace ravencal::test
