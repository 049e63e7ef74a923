// SPDX-License-Identifier: Apache-2.0
//
// The record of the last ticks before a FAULT, through the loaded plugin.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <fstream>
#include <thread>

#include "host/flight_file.hpp"
#include "record/load.hpp"
#include "rt/telemetry_rig.hpp"

namespace ravencal::test {
namespace {

class Flight : public ::testing::Test {
 protected:
  void SetUp() override { rig.load(make_model_with_a_flaw()); }

  /// One tick, with what the host can see of it kept.
  void tick() {
    rig.state.arm[0].enc_counts[1] = static_cast<std::int32_t>(seen.size());
    rig.tick();
    ravencal_tick now{};
    now.t_ns = rig.state.t_ns;
    std::memcpy(now.jpos_ji, rig.state.arm[0].jpos_ji, sizeof now.jpos_ji);
    std::memcpy(now.correction_ji, rig.output.correction_ji, sizeof now.correction_ji);
    std::memcpy(now.predicted_ji, rig.output.predicted_ji, sizeof now.predicted_ji);
    std::memcpy(now.enc_counts, rig.state.arm[0].enc_counts, sizeof now.enc_counts);
    now.runlevel = rig.state.runlevel;
    now.state = rig.output.state;
    now.doubts = rig.output.doubts;
    now.confidence = rig.output.confidence;
    now.would_be_state = rig.output.would_be_state;
    now.step_ns = rig.output.step_ns;
    now.tick = seen.size() + 1;
    seen.push_back(now);
  }
  void ticks(int count) {
    for (int i = 0; i < count; ++i) tick();
  }
  void fault() {
    overflow(rig.state);
    tick();
    ASSERT_NE(rig.output.doubts & RAVENCAL_DOUBT_NETWORK, 0U);
  }
  void recover() {
    rig.state = healthy_state(rig.state.t_ns);
    while (rig.output.state != RAVENCAL_STATE_FAULT) tick();
    rig.api().reset(rig.instance.get());
    tick();
    rig.enable();
  }

  std::int32_t read() {
    flight.struct_size = sizeof flight;
    return rig.api().flight(rig.instance.get(), &flight);
  }
  void expect_record_ends_with(std::size_t last, std::uint32_t count) {
    ASSERT_EQ(flight.ticks, count);
    for (std::uint32_t i = 0; i < count; ++i) {
      const ravencal_tick& wanted = seen[last + 1 - count + i];
      EXPECT_EQ(std::memcmp(&flight.tick[i], &wanted, sizeof wanted), 0) << i;
    }
  }

  Rig rig;
  ravencal_flight flight{};
  std::vector<ravencal_tick> seen;
};

TEST_F(Flight, IsRefusedWhileThereWasNoFault) {
  rig.enable();
  ticks(1000);
  EXPECT_EQ(read(), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(rig.api().flight(rig.instance.get(), nullptr), RAVENCAL_ERROR_ARGUMENT);
  flight.struct_size = sizeof flight - 1;
  EXPECT_EQ(rig.api().flight(rig.instance.get(), &flight), RAVENCAL_ERROR_ARGUMENT);
}

TEST_F(Flight, KeepsTheTwoHundredTicksThatEndWithTheFault) {
  rig.enable();
  ticks(3000);
  ASSERT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
  fault();
  const std::size_t at_fault = seen.size() - 1;
  ASSERT_EQ(read(), RAVENCAL_SUCCESS);
  EXPECT_EQ(flight.faults, 1U);
  expect_record_ends_with(at_fault, RAVENCAL_FLIGHT_TICKS);
  const ravencal_tick& last = flight.tick[RAVENCAL_FLIGHT_TICKS - 1];
  EXPECT_NE(last.doubts & RAVENCAL_DOUBT_NETWORK, 0U);
  for (std::size_t i = 0; i + 1 < RAVENCAL_FLIGHT_TICKS; ++i) {
    EXPECT_EQ(flight.tick[i].doubts, 0U);
    EXPECT_EQ(flight.tick[i + 1].t_ns - flight.tick[i].t_ns, 1'000'000);
  }

  ticks(5000);  // faded out, FAULT, and long after
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FAULT);
  ASSERT_EQ(read(), RAVENCAL_SUCCESS);
  EXPECT_EQ(flight.faults, 1U);
  expect_record_ends_with(at_fault, RAVENCAL_FLIGHT_TICKS);
}

TEST_F(Flight, IsOfTheLastFaultAndAsLongAsThereWereTicks) {
  rig.enable();
  ticks(30);
  fault();
  ASSERT_EQ(read(), RAVENCAL_SUCCESS);
  expect_record_ends_with(30, 31);
  recover();
  rig.load(make_model_with_a_flaw());  // a rollback may have taken the first ones away
  ticks(1500);
  fault();
  const std::size_t second = seen.size() - 1;
  recover();
  ASSERT_EQ(read(), RAVENCAL_SUCCESS);
  EXPECT_EQ(flight.faults, 2U);
  expect_record_ends_with(second, RAVENCAL_FLIGHT_TICKS);
}

TEST_F(Flight, IsReadWholeWhileFaultsFollowEachOther) {
  rig.enable();
  std::atomic<bool> stop{false};
  std::uint64_t reads = 0;
  std::uint64_t broken = 0;
  std::thread reader([&] {
    auto record = std::make_unique<ravencal_flight>();
    record->struct_size = sizeof *record;
    while (!stop.load()) {
      if (rig.api().flight(rig.instance.get(), record.get()) != RAVENCAL_SUCCESS) continue;
      ++reads;
      bool whole = record->ticks > 0 && record->ticks <= RAVENCAL_FLIGHT_TICKS;
      for (std::uint32_t i = 0; whole && i < record->ticks; ++i) {
        const ravencal_tick& tick = record->tick[i];
        const bool is_last = i + 1 == record->ticks;
        const bool faulty = (tick.doubts & RAVENCAL_DOUBT_NETWORK) != 0;
        whole = tick.enc_counts[0] == static_cast<std::int32_t>(tick.tick) && faulty == is_last &&
                (is_last || record->tick[i + 1].tick == tick.tick + 1);
      }
      broken += whole ? 0 : 1;
    }
  });
  std::int32_t number = 0;
  const auto step = [&] {
    rig.state.arm[0].enc_counts[0] = ++number;
    rig.tick();
  };
  for (int faults = 0; faults < 4000 || reads < 2000; ++faults) {
    rig.enable();
    for (int i = 0; i < 20 + faults % 300; ++i) step();
    overflow(rig.state);
    step();
    rig.state = healthy_state(rig.state.t_ns);
    for (int i = 0; i < 3000 && rig.output.state != RAVENCAL_STATE_FAULT; ++i) step();
    rig.api().reset(rig.instance.get());
    step();
  }
  stop.store(true);
  reader.join();
  EXPECT_EQ(broken, 0U) << "of " << reads;
}

TEST_F(Flight, IsWrittenAsACsvThatRavencalReads) {
  const auto path = scratch_folder() / "flight.csv";
  auto faults = host::write_flight(rig.instance, path);
  ASSERT_TRUE(faults.ok());
  EXPECT_EQ(*faults, 0U);
  EXPECT_FALSE(std::filesystem::exists(path));
  rig.enable();
  ticks(500);
  fault();
  faults = host::write_flight(rig.instance, path);
  ASSERT_TRUE(faults.ok()) << faults.error().message;
  EXPECT_EQ(*faults, 1U);
  record::LoadOptions options;
  options.profile = "generic";
  const auto read = record::load_recording(path, options);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->rows(), RAVENCAL_FLIGHT_TICKS);
  const auto column = read->column("estimate.shoulder");
  ASSERT_TRUE(column.has_value());
  EXPECT_EQ(static_cast<float>(read->samples(199, *column)), seen.back().jpos_ji[0]);
  EXPECT_EQ(read->t_ns[199] - read->t_ns[0], 199'000'000);
}

}  // namespace
}  // namespace ravencal::test
