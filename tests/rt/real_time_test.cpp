// SPDX-License-Identifier: Apache-2.0
//
// A step uses no heap, no lock and no system call, in any state and on any input. The alarms that
// check this are shown to trip.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>

#include "core/run_level.hpp"
#include "rt/alarm.hpp"
#include "rt/rig.hpp"
#include "rt/system_call_alarm.hpp"

namespace ravencal::test {
namespace {

TEST(HeapAlarm, RingsForThisProgramAndForALoadedLibrary) {
  arm_alarms();
  std::unique_ptr<std::string> text(new std::string(1000, 'x'));
  text.reset();
  EXPECT_GE(disarm_alarms().heap, 4U);
  arm_alarms();
  void* const library = ::dlopen("libsqlite3.so.0", RTLD_NOW | RTLD_LOCAL);
  const std::uint64_t loading = disarm_alarms().heap;
  ASSERT_NE(library, nullptr) << ::dlerror();
  EXPECT_GT(loading, 0U);
  using Mprintf = char* (*)(const char*, ...);
  const auto print = reinterpret_cast<Mprintf>(::dlsym(library, "sqlite3_mprintf"));
  ASSERT_NE(print, nullptr);
  arm_alarms();
  char* const made = print("%d", 7);
  EXPECT_GE(disarm_alarms().heap, 1U);
  EXPECT_STREQ(made, "7");
}

TEST(LockAlarm, RingsForEveryKindOfLock) {
  std::mutex mutex;
  std::shared_mutex shared;
  sem_t semaphore;
  ::sem_init(&semaphore, 0, 1);
  pthread_spinlock_t spin;
  ::pthread_spin_init(&spin, 0);
  arm_alarms();
  mutex.lock();
  mutex.unlock();
  EXPECT_EQ(disarm_alarms().locks, 1U);
  arm_alarms();
  shared.lock();
  shared.unlock();
  shared.lock_shared();
  shared.unlock_shared();
  EXPECT_EQ(disarm_alarms().locks, 2U);
  arm_alarms();
  ::sem_wait(&semaphore);
  ::pthread_spin_lock(&spin);
  EXPECT_EQ(disarm_alarms().locks, 2U);
}

TEST(LockAlarm, RingsForALoadedLibrary) {
  // A library with locks of its own: SQLite guards its heap and its settings with mutexes.
  void* const library = ::dlopen("libsqlite3.so.0", RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(library, nullptr) << ::dlerror();
  using Open = int (*)(const char*, void**);
  using Close = int (*)(void*);
  const auto open = reinterpret_cast<Open>(::dlsym(library, "sqlite3_open"));
  const auto close = reinterpret_cast<Close>(::dlsym(library, "sqlite3_close"));
  void* database = nullptr;
  arm_alarms();
  ASSERT_EQ(open(":memory:", &database), 0);
  EXPECT_GE(disarm_alarms().locks, 1U);
  close(database);
}

TEST(SystemCallAlarm, RingsAtTheFirstCallAndLetsWorkPass) {
  const ChildEnd quiet = run_in_child([] {
    if (!forbid_system_calls()) return 9;
    volatile int sum = 0;
    for (int i = 0; i < 1000; ++i) sum = sum + i;
    return 3;
  });
  if (quiet.exit_code == 9) GTEST_SKIP() << "this kernel has no seccomp filters";
  EXPECT_FALSE(quiet.called_system);
  EXPECT_EQ(quiet.exit_code, 3);
  const ChildEnd loud = run_in_child([] {
    if (!forbid_system_calls()) return 9;
    return static_cast<int>(::getppid());
  });
  EXPECT_TRUE(loud.called_system);
}

/// Robot states of every kind: a new kind of trouble every 997 ticks, for 13 ticks. Uses neither
/// heap, locks nor the system itself.
void disturb(Rig& rig, std::int64_t tick) {
  static const ravencal_state healthy = healthy_state();
  const std::int64_t t_ns = rig.state.t_ns;
  const bool trouble = tick % 997 < 13;
  switch (trouble ? tick / 997 % 8 : 8) {
    case 0:
      rig.state.arm[0].jpos_ji[0] = std::numeric_limits<float>::quiet_NaN();
      break;
    case 1:
      rig.state.runlevel = core::kEmergencyStop;
      break;
    case 2:
      rig.state.t_ns += 50'000'000;
      break;
    case 3:
      rig.state.arm[0].mpos_rad[1] = 1e30F;
      break;
    case 4:
      rig.enable(false);
      break;
    case 5:
      rig.api().reset(rig.instance.get());
      break;
    case 6:
      rig.state.arm[0].enc_counts[1] += 100'000;
      break;
    case 7:
      rig.state.arm[0].jpos_ji[2] = std::numeric_limits<float>::denorm_min();
      break;
    default:
      rig.state = healthy;
      rig.state.t_ns = t_ns;
      rig.enable();
  }
}

/// Inputs of every transform, and of the current and the latched state.
std::vector<model::FeatureSpec> mixed_features() {
  std::vector<model::FeatureSpec> features;
  for (const char* joint : {"shoulder", "elbow", "insertion"}) {
    for (const char* field : {"jpos.", "mpos.", "mvel.", "tau.", "dac."}) {
      features.push_back(plain(std::string(field) + joint));
    }
    features.push_back(lagged(std::string("jpos.") + joint, 5));
    features.push_back(with_play(std::string("jpos.") + joint, 0.01F));
    features.push_back(mean_of(std::string("tau.") + joint, 0.5F));
    features.push_back(mean_of_abs(std::string("mvel.") + joint, 10.0F));
    const std::string position = std::string("jpos.") + joint;
    features.push_back(travel_mean_of(std::string("tau.") + joint, 0.1F, position));
    features.push_back(travel_mean_of_abs(std::string("mvel.") + joint, 0.1F, position));
  }
  return features;
}

model::CalibrationModel mixed_model(const std::vector<std::uint32_t>& hidden) {
  model::CalibrationModel model = make_model(mixed_features(), hidden);
  const auto n = static_cast<Eigen::Index>(model.features.size());
  model::TrustRegion region;
  region.directions = Eigen::MatrixXf::Identity(3, n);
  region.inverse_variance = Eigen::VectorXf::Ones(3);
  region.full_distance = 3.0F;
  region.none_distance = 12.0F;
  model.trust = region;
  return model;
}

class Step : public ::testing::TestWithParam<model::packed::Precision> {};

INSTANTIATE_TEST_SUITE_P(EveryPrecision, Step,
                         ::testing::Values(model::packed::Precision::kFloat32,
                                           model::packed::Precision::kBfloat16,
                                           model::packed::Precision::kInt8));

TEST_P(Step, UsesNoHeapAndNoLockInCyclesOfEveryKind) {
  Rig rig;
  rig.load(mixed_model({128, 64, 32}), GetParam());
  disturb(rig, 13);  // makes what it keeps
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  float uncorrected[RAVENCAL_JOINTS];
  arm_alarms();
  for (int i = 0; i < 200'000; ++i) {
    disturb(rig, i);
    rig.tick();
    rig.api().uncorrect_desired(rig.instance.get(), rig.output.jpos_ji, uncorrected);
  }
  const AlarmCounts calls = disarm_alarms();
  EXPECT_EQ(calls.heap, 0U);
  EXPECT_EQ(calls.locks, 0U);
  const ravencal_counters counters = rig.instance.counters();
  EXPECT_GT(counters.ticks_in_state[RAVENCAL_STATE_ACTIVE], 10'000U);
  EXPECT_GT(counters.ticks_in_state[RAVENCAL_STATE_FADING_OUT], 1'000U);
}

// Ten million: nearly three hours of the robot's time. Telemetry and flight recorder run with it.
TEST(TenMillionSteps, UseNoHeapNoLockAndNoSystemCall) {
  constexpr std::int64_t kSteps = 10'000'000;
  struct Result {
    AlarmCounts calls;
    ravencal_counters counters;
  };
  void* const memory =
      ::mmap(nullptr, sizeof(Result), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  auto* const result = new (memory) Result{};
  const auto weights = write_weights(mixed_model({32, 16}), "light");
  const std::string name = "/ravencal-test-" + std::to_string(::getpid());
  const ChildEnd end = run_in_child([&] {
    Rig rig([&](ravencal_config& config) { name.copy(config.telemetry_name, 63); });
    if (!rig.instance.load(weights).ok()) return 2;
    rig.enable();
    if (!rig.tick_until(RAVENCAL_STATE_ACTIVE)) return 3;
    disturb(rig, 13);  // makes what it keeps
    float uncorrected[RAVENCAL_JOINTS];
    ravencal_counters counters{};
    counters.struct_size = sizeof counters;
    arm_alarms();
    if (!forbid_system_calls()) return 9;
    for (std::int64_t i = 0; i < kSteps; ++i) {
      disturb(rig, i);
      rig.tick();
      rig.api().uncorrect_desired(rig.instance.get(), rig.output.jpos_ji, uncorrected);
    }
    rig.api().counters(rig.instance.get(), &counters);
    result->calls = disarm_alarms();
    result->counters = counters;
    ::_exit(0);  // a Rig's end calls the system
  });
  ::unlink(("/dev/shm" + name).c_str());
  if (end.exit_code == 9) GTEST_SKIP() << "this kernel has no seccomp filters";
  EXPECT_FALSE(end.called_system);
  ASSERT_EQ(end.exit_code, 0);
  EXPECT_EQ(result->calls.heap, 0U);
  EXPECT_EQ(result->calls.locks, 0U);
  EXPECT_GT(result->counters.ticks, static_cast<std::uint64_t>(kSteps));
  for (const std::size_t state : {RAVENCAL_STATE_ACTIVE, RAVENCAL_STATE_HOLD,
                                  RAVENCAL_STATE_FADING_IN, RAVENCAL_STATE_FADING_OUT}) {
    EXPECT_GT(result->counters.ticks_in_state[state], 1'000U) << state;
  }
  ::munmap(memory, sizeof(Result));
}

}  // namespace
}  // namespace ravencal::test
