// SPDX-License-Identifier: Apache-2.0
//
// Whole lives of the plugin, one after the other: create, load, correct, FAULT and out of it,
// destroy. Nothing of them may be left. RAVENCAL_CYCLES asks for more lives than a test run has
// time for.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "rt/telemetry_rig.hpp"
#include "unit/telemetry_segment.hpp"

namespace ravencal::test {
namespace {

constexpr std::int64_t kLivesOfATestRun = 400;

std::int64_t lives_asked_for() {
  const char* const text = std::getenv("RAVENCAL_CYCLES");
  return text == nullptr ? kLivesOfATestRun : std::atoll(text);
}

/// What this process has of the system.
struct Possessions {
  std::int64_t mapped_kib = 0;
  std::int64_t resident_kib = 0;
  std::int64_t descriptors = 0;
  std::int64_t segments = 0;
};

Possessions possessions() {
  Possessions own;
  std::ifstream("/proc/self/statm") >> own.mapped_kib >> own.resident_kib;
  const std::int64_t page_kib = ::sysconf(_SC_PAGESIZE) / 1024;
  own.mapped_kib *= page_kib;
  own.resident_kib *= page_kib;
  for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator("/proc/self/fd")) {
    ++own.descriptors;
  }
  std::ifstream list("/proc/sysvipc/shm");
  std::string line;
  std::getline(list, line);
  while (std::getline(list, line)) {
    std::istringstream words(line);
    std::int64_t key = 0, id = 0, mode = 0, bytes = 0, creator = 0;
    words >> key >> id >> mode >> bytes >> creator;
    own.segments += creator == ::getpid() ? 1 : 0;
  }
  return own;
}

constexpr std::uint32_t kArms[] = {RAVENCAL_ARM_GOLD, RAVENCAL_ARM_GREEN};

model::CalibrationModel model_of(std::uint32_t arm) {
  model::CalibrationModel model = make_model_with_a_flaw();
  model.origin.arm = arm == RAVENCAL_ARM_GOLD ? model::Arm::kGold : model::Arm::kGreen;
  model.origin.coordinates = model::Coordinates::kMotor;
  return model;
}

/// Into FAULT, and out of it as a controller gets out.
void fault_and_return(Rig& rig, const std::filesystem::path& weights) {
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  provoke_flaw(rig.state);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FAULT));
  EXPECT_EQ(rig.tick(), RAVENCAL_FAULT);
  for (const float correction_ji : rig.output.correction_ji) EXPECT_EQ(correction_ji, 0.0F);
  rig.state = healthy_state(rig.state.t_ns);
  EXPECT_EQ(rig.tick(), RAVENCAL_FAULT) << "until reset, whatever comes";
  rig.api().reset(rig.instance.get());
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_OFF);
  const core::Status loaded = rig.instance.load(weights);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE)) << "it corrects again";
}

TEST(Fault, IsReachedAndLeftAgainAndAgainOnBothArms) {
  for (const std::uint32_t arm : kArms) {
    Rig rig([&](ravencal_config& config) { config.arm = arm; });
    const auto weights = write_weights(model_of(arm), "fault");
    ASSERT_TRUE(rig.instance.load(weights).ok());
    for (int round = 0; round < 20; ++round) fault_and_return(rig, weights);
    EXPECT_EQ(rig.instance.info().arm, arm);
    EXPECT_GT(rig.instance.counters().ticks_in_state[RAVENCAL_STATE_FAULT], 20U);
  }
}

#if defined(__x86_64__)
TEST(OldProcessor, GetsTheKernelsThatItHas) {
  Rig rig;
  rig.load(make_model(16, {8}));
  const bool modern = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  EXPECT_EQ(rig.instance.info().isa == RAVENCAL_ISA_BASELINE, !modern);
}
#endif

TEST(LifeCycle, LeavesNothingBehindOverManyLivesOfBothArms) {
  const std::int64_t lives = lives_asked_for();
  const std::int64_t settled = lives / 4;  // by then the C library has what it keeps
  const std::string name = telemetry_name("lives");
  const std::filesystem::path weights[] = {write_weights(model_of(kArms[0]), "gold"),
                                           write_weights(model_of(kArms[1]), "green")};
  const plugin_host::Library library =
      std::move(plugin_host::Library::open(RAVENCAL_PLUGIN_PATH)).value();
  ravencal_config config = library.default_config();
  name.copy(config.telemetry_name, sizeof config.telemetry_name - 1);
  Possessions before;
  const auto start = std::chrono::steady_clock::now();
  for (std::int64_t life = 0; life < lives; ++life) {
    if (life == settled) before = possessions();
    const auto arm = static_cast<std::size_t>(life % 2);
    config.arm = kArms[arm];
    auto plugin = plugin_host::Instance::create(library, config);
    ASSERT_TRUE(plugin.ok()) << "life " << life << ": " << plugin.error().message;
    const core::Status loaded = plugin->load(weights[arm]);
    ASSERT_TRUE(loaded.ok()) << "life " << life << ": " << loaded.error().message;
    ravencal_state state = healthy_state();
    ravencal_output output{};
    output.struct_size = sizeof output;
    plugin->api().enable(plugin->get(), 1);
    // Some die with weights that were never taken, some with weights on offer beside others.
    for (std::int64_t tick = life % 3; tick > 0; --tick) {
      state.t_ns += 1'000'000;
      ASSERT_GE(plugin->api().step(plugin->get(), &state, &output), RAVENCAL_OK);
      ASSERT_TRUE(plugin->load(weights[arm]).ok());
    }
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const Possessions after = possessions();
  EXPECT_EQ(after.descriptors, before.descriptors);
  EXPECT_EQ(after.segments, 0);
  // A life maps some megabytes: were they kept, this would be found after a few lives.
  EXPECT_LE(after.mapped_kib, before.mapped_kib + 4096);
  EXPECT_FALSE(std::filesystem::exists("/dev/shm" + name));
  std::printf(
      "%lld lives in %.0f s: mapped %lld -> %lld KiB, resident %lld -> %lld KiB, %lld -> "
      "%lld descriptors\n",
      static_cast<long long>(lives), took.count(), static_cast<long long>(before.mapped_kib),
      static_cast<long long>(after.mapped_kib), static_cast<long long>(before.resident_kib),
      static_cast<long long>(after.resident_kib), static_cast<long long>(before.descriptors),
      static_cast<long long>(after.descriptors));
}

}  // namespace
}  // namespace ravencal::test
