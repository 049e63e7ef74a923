// SPDX-License-Identifier: Apache-2.0
//
// `ravencal rezero` beside a running control loop: from a known pose to the joints that the robot
// has then; the request's damage, the pedal, another homing.
#include <filesystem>
#include <functional>
#include <string>

#include "core/whole_file.hpp"
#include "model/homing_constants.hpp"
#include "rt/control_rig.hpp"

namespace ravencal::test {
namespace {

constexpr std::size_t kConstantWords = sizeof(ravencal_constant_request) / sizeof(std::uint64_t);
using ConstantWords = std::array<std::uint64_t, kConstantWords>;

/// With the check that belongs to it.
ravencal_constant_request checked_constant(ravencal_constant_request record) {
  const auto words = std::bit_cast<ConstantWords>(record);
  record.check = RAVENCAL_CONSTANT_CHECK(words[0], words[1], words[2], words[3], words[4]);
  return record;
}

class RezeroProgram : public ControlRig {
 protected:
  void SetUp() override {
    ControlRig::SetUp();
    if (IsSkipped()) return;
    auto model = make_model(16, {});
    std::vector<model::HomingConstants> seen;
    for (const auto& output : model.outputs)
      seen.push_back({output.joint, {-0.01, 0.0, 0.01}, 1e-3});
    model::keep_homing_constants(model, seen);
    weights = write_weights(model, "rezero");
    ASSERT_TRUE(rig.instance.load(weights).ok());
    rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_ARM);
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
    for (int i = 0; i < 500; ++i) rig.tick();
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove(file(), ignored);
    ControlRig::TearDown();
  }
  [[nodiscard]] std::filesystem::path file() const { return weights.string() + ".homing.json"; }

  /// The program beside the running loop.
  Ended rezero(const std::string& arguments) {
    std::atomic<bool> done{false};
    Ended ended;
    std::thread program([&] {
      ended = call_program("rezero --weights " + weights.string() + " " + arguments);
      done = true;
    });
    run_until(done);
    program.join();
    return ended;
  }
  Ended at_elbow(double error_rad, const std::string& more = "") {
    const double true_rad = static_cast<double>(rig.state.arm[0].jpos_ji[1]) +
                            static_cast<double>(rig.output.predicted_ji[1]) + error_rad;
    return rezero("--at elbow=" + std::to_string(true_rad) + "rad+-0.001rad --name " + name + " " +
                  more);
  }
  void expect_end(const Ended& ended, int code, const std::string& says) {
    EXPECT_EQ(ended.code, code) << ended.text;
    EXPECT_NE(ended.text.find(says), std::string::npos) << ended.text;
  }
  void expect_added(float elbow_rad) {
    for (int i = 0; i < 1500; ++i) rig.tick();
    EXPECT_NEAR(rig.output.correction_ji[1], rig.output.predicted_ji[1] + elbow_rad, 1e-5);
    EXPECT_NEAR(rig.output.correction_ji[0], rig.output.predicted_ji[0], 1e-6);
    EXPECT_NEAR(opened(name).homing().constant.constant_ji[1], elbow_rad, 1e-5);
  }

  std::filesystem::path weights;
};

TEST_F(RezeroProgram, TakesTheConstantOfThisHomingAndNoOther) {
  const std::string blob = core::read_whole_file(weights).value();
  expect_end(at_elbow(0.01, "--dry-run"), 0, "0.57");
  expect_added(0.0F);
  EXPECT_FALSE(std::filesystem::exists(file()));
  expect_end(at_elbow(0.01), 0, "taken; it goes with the next homing");
  expect_added(0.01F);
  EXPECT_EQ(core::read_whole_file(weights).value(), blob) << "the weights stay";

  expect_end(rezero("--end --name " + name), 0, "taken away");
  expect_added(0.0F);
  expect_end(rezero("--name " + name), 0, "taken; it goes");
  expect_added(0.01F);

  rig.state.runlevel = core::kInit;
  for (int i = 0; i < 100; ++i) rig.tick();
  for (int& offset : rig.state.arm[0].enc_offset_counts) offset += 17;
  rig.state.runlevel = core::kPedalUp;
  rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_ARM);
  expect_added(0.0F);
  expect_end(rezero("--name " + name), 1, "homed again since");
  expect_added(0.0F);
  expect_end(at_elbow(-0.02), 0, "taken; it goes");
  expect_added(-0.02F);
}

TEST_F(RezeroProgram, RefusesByASentenceAndLeavesThePluginAlone) {
  expect_end(at_elbow(0.09), 1, "refused: elbow: the constant of 5.157 deg is beyond the");
  expect_end(at_elbow(6.2831853), 1, "1 turn off");
  rig.set_pedal(true);
  expect_end(at_elbow(0.01), 1, "the pedal was not up");
  rig.set_pedal(false);
  expect_added(0.0F);
  EXPECT_FALSE(std::filesystem::exists(file()));

  rig.load(make_model(16, {}, 2));
  for (int i = 0; i < 100; ++i) rig.tick();
  expect_end(at_elbow(0.01), 3, "runs other weights");
  expect_end(rezero("--at elbow=1deg --name " + name), 2, "JOINT=VALUE+-UNCERTAINTY");
  expect_end(rezero("--name " + name), 3, "homing.json");
  expect_end(rezero("--at elbow=1deg+-1deg"), 2, "--recording or --name is needed");
}

// What the plugin takes of a request of which another program has changed any bit.
TEST_F(RezeroProgram, TheConstantOfARequestIsWholeOrNone) {
  ravencal_request request = newer(RAVENCAL_REQUEST_HOMING_CONSTANT);
  ravencal_homing_constant constant{};
  constant.struct_size = sizeof constant;
  constant.weights_checksum = rig.instance.info().checksum;
  constant.constant_ji[1] = 0.01F;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j)
    constant.enc_offset_counts[j] = rig.state.arm[0].enc_offset_counts[j];
  const ravencal_constant_request record = checked_constant({request.number, constant, 0});
  const std::uint64_t before = taken();
  const auto write = [&](const ConstantWords& words) {
    for (std::size_t i = 0; i < kConstantWords; ++i) {
      std::atomic_ref<std::uint64_t>(memory[kRequestWords + i])
          .store(words[i], std::memory_order_release);
    }
    write_words(memory, request);
  };
  for (int bit = 0; bit < 64 * static_cast<int>(kConstantWords); ++bit) {
    auto words = std::bit_cast<ConstantWords>(record);
    words[static_cast<std::size_t>(bit / 64)] ^= std::uint64_t{1} << (bit % 64);
    write(words);
    for (int i = 0; i < 5; ++i) rig.tick();
    ASSERT_EQ(taken(), before) << bit;
  }
  rig.set_pedal(true);
  write(std::bit_cast<ConstantWords>(record));
  for (int i = 0; i < 20; ++i) rig.tick();
  ASSERT_EQ(taken(), before) << "the pedal is down";
  rig.set_pedal(false);
  for (int i = 0; i < 20; ++i) rig.tick();
  EXPECT_EQ(taken(), request.number);
  expect_added(0.01F);
}

}  // namespace
}  // namespace ravencal::test
