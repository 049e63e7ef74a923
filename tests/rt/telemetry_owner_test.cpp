// SPDX-License-Identifier: Apache-2.0
//
// Who owns a telemetry name: one process, whoever else wants it at the same time, and never the
// child of a fork. And that no owner's clumsiness with the files reaches the control loop.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <atomic>
#include <memory>
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

std::string path_of(const std::string& name) { return "/dev/shm" + name; }

bool exists(const std::string& name) {
  struct stat status = {};
  return ::stat(path_of(name).c_str(), &status) == 0;
}

/// Steps on which processes wait for each other, in memory that they share.
class Steps {
 public:
  Steps()
      : count_(static_cast<std::atomic<int>*>(::mmap(nullptr, sizeof(std::atomic<int>),
                                                     PROT_READ | PROT_WRITE,
                                                     MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {}
  Steps(const Steps&) = delete;
  Steps& operator=(const Steps&) = delete;
  ~Steps() { ::munmap(count_, sizeof *count_); }

  void done() const { ++*count_; }
  void wait_for(int count) const {
    while (*count_ < count) ::usleep(100);
  }
  [[nodiscard]] int count() const { return *count_; }

 private:
  std::atomic<int>* count_;
};

/// Leaves what a killed writer leaves.
void leave_dead(const std::string& name) {
  ChildProcess writer([&]() -> int {
    Rig rig;
    (void)give_telemetry(rig, name);
    ::raise(SIGKILL);
    return 1;
  });
  writer.wait();
  ASSERT_TRUE(exists(name));
}

/// How many of `count` processes that create `name` at once own it. Each ends only when all have
/// tried. `kept`: whether the name is there while the owner lives, also after the others ended.
int owners_among(int count, const std::string& name, bool& kept) {
  const Steps ready;
  const Steps owned;
  const Steps tried;
  const Steps judged;
  std::vector<std::unique_ptr<ChildProcess>> processes;
  for (int i = 0; i < count; ++i) {
    processes.push_back(std::make_unique<ChildProcess>([&]() -> int {
      auto rig = std::make_unique<Rig>();
      ready.done();
      ready.wait_for(count);
      const bool owns = give_telemetry(*rig, name).ok();
      if (owns) owned.done();
      tried.done();
      tried.wait_for(count);
      if (owns) judged.wait_for(count - owned.count());
      const bool there = exists(name);
      rig.reset();
      judged.done();
      return (owns ? 1 : 0) + (there ? 2 : 0);
    }));
  }
  int owners = 0;
  kept = true;
  for (const auto& process : processes) {
    const int result = WEXITSTATUS(process->wait());
    owners += result % 2;
    kept = kept && result >= 2;
  }
  return owners;
}

TEST(TelemetryName, HasOneOwnerHoweverManyWantItAtOnce) {
  const std::string name = telemetry_name("race");
  for (int round = 0; round < 60; ++round) {
    if (round % 2 == 1) leave_dead(name);
    bool kept = false;
    ASSERT_EQ(owners_among(3, name, kept), 1) << "round " << round;
    ASSERT_TRUE(kept) << "round " << round;
    ASSERT_FALSE(exists(name)) << "the owner removes it";
  }
}

TEST(TelemetryName, IsLeftAloneByAnOwnerWhoLostIt) {
  const std::string name = telemetry_name("lost");
  auto first = std::make_unique<Rig>();
  ASSERT_TRUE(give_telemetry(*first, name).ok());
  ASSERT_EQ(::unlink(path_of(name).c_str()), 0);
  Rig second;
  ASSERT_TRUE(give_telemetry(second, name).ok());
  first.reset();
  EXPECT_EQ(opened(name).writer(), Writer::kAlive);
}

TEST(TelemetryName, IsNotRefusedBecauseSomebodyAsksWhetherItsDeadOwnerLives) {
  const std::string name = telemetry_name("asked");
  ChildProcess writer([&]() -> int {
    Rig rig;
    if (!give_telemetry(rig, name).ok()) return 1;
    for (;;) ::pause();
  });
  while (!exists(name)) ::usleep(1000);
  const TelemetryReader reader = opened(name);
  writer.signal(SIGKILL);
  writer.wait();
  const Steps stop;
  ChildProcess asks([&]() -> int {
    for (;;) (void)reader.writer();
  });
  for (int round = 0; round < 20; ++round) {
    Rig rig;
    const core::Status status = give_telemetry(rig, name);
    EXPECT_TRUE(status.ok()) << status.error().message;
  }
}

TEST(TelemetryName, AndMemoryAreNotTheChildsOfAFork) {
  const std::string name = telemetry_name("fork");
  const Steps step;
  const Steps over;
  ChildProcess parent([&]() -> int {
    auto rig = std::make_unique<Rig>();
    if (!give_telemetry(*rig, name).ok()) return 1;
    rig->tick();
    ChildProcess child([&]() -> int {
      for (int i = 0; i < 5000; ++i) rig->tick();
      rig.reset();
      step.done();
      over.wait_for(1);
      return 0;
    });
    step.wait_for(1);
    rig->tick();
    step.done();
    for (;;) ::pause();
  });
  step.wait_for(2);
  TelemetryReader reader = opened(name);
  std::vector<NumberedTick> ticks;
  reader.read(ticks);
  EXPECT_EQ(ticks.size(), 2U) << "the parent's alone";
  EXPECT_EQ(reader.writer(), Writer::kAlive) << "the child's destroy changes nothing";
  parent.signal(SIGKILL);
  parent.wait();
  EXPECT_EQ(reader.writer(), Writer::kGone) << "the child that lives on does not hold the lock";
  Rig next;
  EXPECT_TRUE(give_telemetry(next, name).ok());
  over.done();
}

TEST(TelemetryName, SurvivesAHostThatFreesItsStorageAndForks) {
  const std::string name = telemetry_name("freed");
  ChildProcess clumsy([&]() -> int {
    Rig rig;
    rig.config.telemetry_name[0] = '\0';
    name.copy(rig.config.telemetry_name, 63);
    const std::size_t bytes = rig.api().storage_size();
    void* const storage =
        ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    ravencal_instance* instance = nullptr;
    if (rig.api().create(&rig.config, storage, bytes, &instance) != RAVENCAL_SUCCESS) return 1;
    ::munmap(storage, bytes);
    ChildProcess child([] { return 0; });
    return WIFEXITED(child.wait()) ? 0 : 2;
  });
  const int status = clumsy.wait();
  ASSERT_TRUE(WIFEXITED(status)) << "ended by a signal";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Telemetry, GoesOnWhenItsOwnerTruncatesOrRemovesWhatIsInDevShm) {
  const std::string name = telemetry_name("truncated");
  ChildProcess host([&]() -> int {
    Rig rig;
    if (!give_telemetry(rig, name).ok()) return 1;
    TelemetryReader reader = opened(name);
    std::vector<NumberedTick> ticks;
    if (::truncate(path_of(name).c_str(), 0) != 0) return 2;
    for (int i = 0; i < 5000; ++i) rig.tick();
    reader.read(ticks);
    if (ticks.empty() || reader.writer() != Writer::kAlive) return 3;
    if (::unlink(path_of(name).c_str()) != 0) return 4;
    for (int i = 0; i < 5000; ++i) rig.tick();
    return reader.counters()->ticks == 10'000 ? 0 : 5;
  });
  const int status = host.wait();
  ASSERT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

/// What a process that is left so little of `resource` hears from create; "" if it succeeds.
std::string heard_with(const std::function<void()>& restrict_self, std::int32_t expected) {
  const std::string name = telemetry_name("limited");
  int answer[2];
  EXPECT_EQ(::pipe(answer), 0);
  ChildProcess limited([&]() -> int {
    Rig rig;
    name.copy(rig.config.telemetry_name, 63);
    const std::size_t bytes = (rig.api().storage_size() + 63) / 64 * 64;
    void* const storage = std::aligned_alloc(64, bytes);
    ravencal_instance* instance = nullptr;
    restrict_self();
    const std::int32_t code = rig.api().create(&rig.config, storage, bytes, &instance);
    const char* const reason = std::strerror(errno);
    if (code == RAVENCAL_SUCCESS) return 0;
    const auto length = static_cast<ssize_t>(std::strlen(reason));
    return code == expected && ::write(answer[1], reason, std::strlen(reason)) == length ? 0 : 9;
  });
  const int status = limited.wait();
  EXPECT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0) << "another code";
  EXPECT_FALSE(exists(name));
  char text[100] = {};
  ::close(answer[1]);
  (void)::read(answer[0], text, sizeof text - 1);
  ::close(answer[0]);
  return text;
}

void limit(int resource, rlim_t most) {
  const rlimit both{most, most};
  if (::setrlimit(static_cast<__rlimit_resource_t>(resource), &both) != 0) std::abort();
}

TEST(Telemetry, NamesALimitOfTheProcessAndLeavesNothing) {
  EXPECT_EQ(heard_with([] { limit(RLIMIT_NOFILE, 3); }, RAVENCAL_ERROR_LIMIT),
            std::strerror(EMFILE));
  EXPECT_EQ(heard_with([] { limit(RLIMIT_FSIZE, 0); }, RAVENCAL_ERROR_LIMIT), std::strerror(EFBIG))
      << "without SIGXFSZ";
  EXPECT_EQ(heard_with([] { limit(RLIMIT_AS, 4096); }, RAVENCAL_ERROR_MEMORY),
            std::strerror(ENOMEM));
}

TEST(Telemetry, TellsTheHostWhichLimit) {
  ChildProcess limited([]() -> int {
    Rig rig;
    limit(RLIMIT_FSIZE, 0);
    const core::Status refused = give_telemetry(rig, telemetry_name("told"));
    if (refused.ok()) return 1;
    return refused.error().message.find("File too large") != std::string::npos ? 0 : 2;
  });
  EXPECT_EQ(WEXITSTATUS(limited.wait()), 0);
}

}  // namespace
}  // namespace ravencal::test
