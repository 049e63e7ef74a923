// SPDX-License-Identifier: Apache-2.0
//
// The telemetry of the loaded plugin: what it says, whom it refuses, and that nobody who watches
// can change anything.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <optional>
#include <random>

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

TelemetryReader opened(const std::string& name) {
  core::Result<TelemetryReader> reader = TelemetryReader::open(name);
  if (!reader.ok()) {
    ADD_FAILURE() << reader.error().message;
    std::abort();
  }
  return std::move(reader).value();
}

/// What a robot may do to a plugin in its tick `number`, the same for every rig: slow motion, and
/// trouble now and then.
void disturb(ravencal_state& state, std::mt19937& random, int number) {
  state = healthy_state(state.t_ns);
  for (int j = 0; j < RAVENCAL_SLOTS; ++j) {
    state.arm[0].jpos_ji[j] += 0.2F * std::sin(static_cast<float>(number) * 0.002F + 2.0F * j);
    state.arm[0].enc_counts[j] = number * (j + 1);
  }
  switch (random() % 20'000) {
    case 0:
      state.arm[0].jpos_ji[random() % 8] = std::numeric_limits<float>::quiet_NaN();
      break;
    case 1:
      state.runlevel = 0;
      break;
    case 2:
      state.t_ns += 40'000'000;
      break;
    case 3:
      state.arm[0].jpos_ji[1] = 1e-41F;
      break;
    default:
      break;
  }
}

/// All that step wrote, but how long it took.
bool same_output(const ravencal_output& a, const ravencal_output& b) {
  return std::memcmp(&a, &b, offsetof(ravencal_output, step_ns)) == 0;
}

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
    EXPECT_GE(static_cast<std::size_t>(status.st_blocks) * 512,
              RAVENCAL_TELEMETRY_HEADER_BYTES +
                  RAVENCAL_TELEMETRY_SLOTS * sizeof(ravencal_telemetry_slot))
        << "every page is there before the first tick";
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
  EXPECT_EQ(opened(name).writer(), Writer::kGone);
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

TEST(Telemetry, RefusesWhatIsNoName) {
  Rig rig;
  for (const char* name : {"x", "/", "/a/b", "/../x", "/.x", "ravencal-left"}) {
    EXPECT_FALSE(give_telemetry(rig, name).ok()) << name;
    std::memset(rig.config.telemetry_name, 0, sizeof rig.config.telemetry_name);
  }
  std::memset(rig.config.telemetry_name, 'x', sizeof rig.config.telemetry_name);
  rig.config.telemetry_name[0] = '/';
  EXPECT_FALSE(host::PluginInstance::create(rig.library, rig.config).ok()) << "without its end";
}

TEST(Telemetry, LeavesNothingBehindWhereMemoryIsFull) {
  // A file of its own limit stands for a full /dev/shm: both refuse the reservation.
  ChildProcess limited([]() -> int {
    const rlimit limit{4096, 4096};
    ::signal(SIGXFSZ, SIG_IGN);
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) return 1;
    Rig rig;
    const std::string name = telemetry_name("full");
    if (give_telemetry(rig, name).ok()) return 2;
    for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
      if (file.path().string().find(name.substr(1)) != std::string::npos) return 3;
    }
    return 0;
  });
  EXPECT_EQ(WEXITSTATUS(limited.wait()), 0);
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

TEST(Telemetry, CannotBeWrittenByAReader) {
  const std::string name = telemetry_name("readonly");
  Rig rig;
  ASSERT_TRUE(give_telemetry(rig, name).ok());
  const int file = ::open(("/dev/shm" + name).c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_GE(file, 0);
  EXPECT_EQ(::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0), MAP_FAILED);
  EXPECT_EQ(errno, EACCES);
  void* const memory = ::mmap(nullptr, 4096, PROT_READ, MAP_SHARED, file, 0);
  ASSERT_NE(memory, MAP_FAILED);
  ChildProcess vandal([&]() -> int {
    ::signal(SIGSEGV, SIG_DFL);
    *static_cast<volatile char*>(memory) = 'X';
    return 0;
  });
  const int status = vandal.wait();
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGSEGV);
  EXPECT_EQ(*static_cast<char*>(memory), RAVENCAL_TELEMETRY_MAGIC[0]);
  ::munmap(memory, 4096);
  ::close(file);
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
