// SPDX-License-Identifier: Apache-2.0
//
// The adapter in a controller in miniature, of both branches, as old and as new C++: every field in
// its slot and unit, arms by type, the correction both ways, and nothing changed where it is
// undone.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host/robot_state.hpp"
#include "physics/raven_kinematics.hpp"
#include "rt/rig.hpp"
#include "unit/integration_controller.h"

extern "C" {
const controller_api* controller_main_98(void);
const controller_api* controller_main_17(void);
const controller_api* controller_crtk_98(void);
const controller_api* controller_crtk_17(void);
}

namespace ravencal::test {
namespace {

constexpr int kEStop = 0;
constexpr int kInit = 1;
constexpr int kPedalUp = 2;
constexpr int kPedalDown = 3;
constexpr double kRadPerCount = 2.0 * 3.14159265358979 / 4000.0;
constexpr std::array<double, 3> kReduction = {136.196, 121.522, 2158.59};

struct Case {
  const char* name;
  const controller_api* (*entry)();
  int green;
};

class Controller {
 public:
  Controller(const controller_api& api, const controller_setup& setup)
      : api_(api), self_(api.start(&setup), api.stop) {}
  void run(int runlevel, int cycles) {
    for (int i = 0; i < cycles; ++i) api_.cycle(get(), runlevel);
  }
  void home() {
    api_.begin_homing(get());
    run(kInit, 1500);
  }
  [[nodiscard]] const ravencal_state& seen() const { return *api_.seen(get()); }
  [[nodiscard]] const ravencal_output& output() const { return *api_.output(get()); }
  [[nodiscard]] std::string bytes() const {
    std::size_t count = 0;
    const void* const device = api_.device(get(), &count);
    return {static_cast<const char*>(device), count};
  }
  [[nodiscard]] controller* get() const { return self_.get(); }

 private:
  const controller_api& api_;
  std::unique_ptr<controller, void (*)(controller*)> self_;
};

/// Trained around the miniature's home; constant corrections of 0.02 rad, -0.03 rad and 2 mm, with
/// a little dependence on the joints.
model::CalibrationModel model_for_home(bool green) {
  model::CalibrationModel model =
      make_model({plain("jpos.shoulder"), plain("jpos.elbow"), plain("jpos.insertion")}, {});
  model.input.mean << 0.52, 1.57, 0.40;
  model.input.scale = Eigen::Vector3d(0.3, 0.3, 0.1);
  model.input_min = model.input.mean.array() - 2.0;
  model.input_max = model.input.mean.array() + 2.0;
  model.layers[0].weights.setIdentity();
  model.layers[0].weights *= 0.01F;
  model.layers[0].biases.setZero();
  model.output.mean = Eigen::Vector3d(0.02, -0.03, 0.002);
  model.origin.arm = green ? model::Arm::kGreen : model::Arm::kGold;
  return model;
}

class Integration : public ::testing::TestWithParam<Case> {
 protected:
  Integration()
      : api(*GetParam().entry()),
        weights(write_weights(model_for_home(GetParam().green != 0), "integration")) {}

  [[nodiscard]] controller_setup setup(int lines, bool with_plugin = true) const {
    return {lines,
            with_plugin ? RAVENCAL_PLUGIN_PATH : nullptr,
            weights.c_str(),
            nullptr,
            GetParam().green,
            0,
            0};
  }
  [[nodiscard]] Controller made(int lines, bool with_plugin = true) const {
    const controller_setup chosen = setup(lines, with_plugin);
    return {api, chosen};
  }
  void go_active(Controller& controller) {
    controller.run(kEStop, 20);
    controller.home();
    controller.run(kPedalUp, 1000);
    ASSERT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
    controller.run(kPedalDown, 500);
  }

  const controller_api& api;
  const std::filesystem::path weights;
};

INSTANTIATE_TEST_SUITE_P(EveryBranch, Integration,
                         ::testing::Values(Case{"main_98_gold", controller_main_98, 0},
                                           Case{"main_98_green", controller_main_98, 1},
                                           Case{"main_17_gold", controller_main_17, 0},
                                           Case{"crtk_98_gold", controller_crtk_98, 0},
                                           Case{"crtk_98_green", controller_crtk_98, 1},
                                           Case{"crtk_17_green", controller_crtk_17, 1}),
                         [](const auto& which) { return std::string(which.param.name); });

/// Pose of one arm's tool as the controller would publish it without the correction.
physics::ToolPose pose_without(const ravencal_arm& joints_of, const float* joints_ji, bool green) {
  physics::SlotVector joints{};
  for (std::size_t j = 0; j < RAVENCAL_SLOTS; ++j) {
    joints[j] = static_cast<double>(j < 3 ? joints_ji[j] : joints_of.jpos_ji[j]);
  }
  return physics::forward_kinematics(green ? physics::Arm::kGreen : physics::Arm::kGold, joints);
}

/// The published message, through the units and the mapping that a recording of it takes to
/// training.
ravencal_state as_recorded(const controller_api& api, const Controller& controller, bool green) {
  host::CatalogueValues message{};
  api.published(controller.get(), message.data());
  if (green) {  // "this arm" is the second half of every field: exchange the halves
    for (const core::RavenFieldInfo& field : core::kRavenFields) {
      if (!field.per_arm) continue;
      std::swap_ranges(message.begin() + static_cast<std::ptrdiff_t>(field.first),
                       message.begin() + static_cast<std::ptrdiff_t>(field.first + field.count),
                       message.begin() + static_cast<std::ptrdiff_t>(field.first + field.count));
    }
  }
  ravencal_state state{};
  host::fill_state(host::to_si(message), controller.seen().t_ns, true, state);
  return state;
}

template <std::size_t kCount>
void expect_same(const char* what, const float (&seen)[kCount], const float (&recorded)[kCount]) {
  for (std::size_t i = 0; i < kCount; ++i) {
    EXPECT_NEAR(seen[i], recorded[i], 2e-6 * (1.0 + std::fabs(static_cast<double>(recorded[i]))))
        << what << " " << i;
  }
}
template <std::size_t kCount>
void expect_same(const char* what, const int32_t (&seen)[kCount],
                 const int32_t (&recorded)[kCount]) {
  for (std::size_t i = 0; i < kCount; ++i) EXPECT_EQ(seen[i], recorded[i]) << what << " " << i;
}

TEST_P(Integration, SeesEveryFieldAsARecordingMadeWithoutThePluginHoldsIt) {
  Controller controller = made(CONTROLLER_WITH);
  go_active(controller);
  const ravencal_state& seen = controller.seen();
  const ravencal_state recorded = as_recorded(api, controller, GetParam().green != 0);
  EXPECT_EQ(seen.runlevel, recorded.runlevel);
  EXPECT_EQ(seen.sublevel, recorded.sublevel);
  EXPECT_EQ(seen.last_seq, 111);
  for (int a = 0; a < 2; ++a) {
    const ravencal_arm& own = seen.arm[a];
    const ravencal_arm& other = recorded.arm[a];
    EXPECT_EQ(own.type, other.type);
    expect_same("enc", own.enc_counts, other.enc_counts);
    expect_same("enc_offset", own.enc_offset_counts, other.enc_offset_counts);
    expect_same("dac", own.dac_counts, other.dac_counts);
    expect_same("tau", own.tau_n_m, other.tau_n_m);
    expect_same("mpos", own.mpos_rad, other.mpos_rad);
    expect_same("mpos_d", own.mpos_d_rad, other.mpos_d_rad);
    expect_same("mvel", own.mvel_rad_per_s, other.mvel_rad_per_s);
    expect_same("jvel", own.jvel_ji, other.jvel_ji);
    EXPECT_NEAR(own.grasp_d_rad, other.grasp_d_rad, 1e-6);
    expect_same("jac_vel", own.jac_vel, other.jac_vel);
    expect_same("jac_f", own.jac_f, other.jac_f);
    for (std::size_t j = 0; j < RAVENCAL_SLOTS; ++j) {
      const bool corrected = a == 0 && j < RAVENCAL_JOINTS;
      const float taken_out = corrected ? controller.output().correction_ji[j] : 0.0F;
      if (corrected) {
        EXPECT_GT(std::fabs(taken_out), 1e-3F);
      }
      EXPECT_NEAR(own.jpos_ji[j], other.jpos_ji[j] - taken_out, 2e-6) << j;
      EXPECT_NEAR(own.jpos_d_ji[j], other.jpos_d_ji[j] - taken_out, 2e-6) << j;
    }
  }
  // The miniature's own numbers, without the detour: home is 30 deg, 90 deg, 0.4 m.
  EXPECT_NEAR(seen.arm[0].jpos_ji[0], 0.53, 0.1);
  EXPECT_NEAR(seen.arm[0].jpos_ji[1], 1.58, 0.1);
  EXPECT_NEAR(seen.arm[0].jpos_ji[2], 0.400, 0.05);
  EXPECT_NEAR(seen.arm[0].mpos_rad[2], 0.4 * 2158.6, 150.0);
  EXPECT_NE(seen.arm[0].enc_counts[0], seen.arm[1].enc_counts[0]);
}

/// Position and rotation against forward kinematics of other joints. Both sides were truncated or
/// rounded to whole micrometres.
void expect_pose(const physics::ToolPose& expected, const int32_t (&position_um)[3],
                 const float (&rotation)[9]) {
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(position_um[k], expected.position_um[k], 3) << k;
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(rotation[k], expected.rotation[k], 1e-5) << k;
}

TEST_P(Integration, SeesPosesAsForwardKinematicsOfUncorrectedJointsGivesThem) {
  Controller controller = made(CONTROLLER_WITH);
  go_active(controller);
  const ravencal_state& seen = controller.seen();
  const bool green = GetParam().green != 0;
  // The message's slot 0 holds the pose of the first board's arm, which in the CRTK branch is
  // green.
  const bool first_is_green = std::string(api.branch) == "crtk";
  for (int a = 0; a < 2; ++a) {
    const bool slot_of_green = green == (a == 0);
    const bool pose_of_green = slot_of_green != first_is_green;
    const bool pose_of_calibrated = pose_of_green == green;
    const ravencal_arm& joints = seen.arm[pose_of_calibrated ? 0 : 1];
    expect_pose(pose_without(joints, joints.jpos_ji, pose_of_green), seen.arm[a].pos_um,
                seen.arm[a].ori);
    ravencal_arm desired = joints;
    std::copy_n(joints.jpos_d_ji, RAVENCAL_SLOTS, desired.jpos_ji);
    expect_pose(pose_without(desired, desired.jpos_ji, pose_of_green), seen.arm[a].pos_d_um,
                seen.arm[a].ori_d);
  }
}

TEST_P(Integration, RefusesWeightsOfTheOtherArm) {
  controller_setup chosen = setup(CONTROLLER_WITH);
  const auto wrong = write_weights(model_for_home(GetParam().green == 0), "wrong_arm");
  chosen.weights = wrong.c_str();
  Controller controller(api, chosen);
  EXPECT_NE(std::string(api.error(controller.get())).find("was trained for the"), std::string::npos)
      << api.error(controller.get());
  controller.run(kEStop, 20);
  controller.home();
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_OFF) << "the plugin was not opened";
}

TEST_P(Integration, ReadsNoJacobianBeforeTheControllerHasComputedOne) {
  Controller controller = made(CONTROLLER_WITH);
  controller.run(kEStop, 5);
  EXPECT_EQ(api.early_reads(controller.get()), 0);
}

TEST_P(Integration, RefusesAnArmThatTheRobotLacks) {
  controller_setup chosen = setup(CONTROLLER_WITH);
  chosen.absent_arm = 1;
  Controller controller(api, chosen);
  EXPECT_NE(std::string(api.error(controller.get())).find("none of the"), std::string::npos)
      << api.error(controller.get());
}

/// Where types of arms are not unique.
class CrtkIntegration : public Integration {};

INSTANTIATE_TEST_SUITE_P(CrtkBranch, CrtkIntegration,
                         ::testing::Values(Case{"crtk_98", controller_crtk_98, 0},
                                           Case{"crtk_17", controller_crtk_17, 0}),
                         [](const auto& which) { return std::string(which.param.name); });

TEST_P(CrtkIntegration, RefusesATypeThatTwoArmsShare) {
  controller_setup chosen = setup(CONTROLLER_WITH);
  chosen.by_type = 1;
  Controller controller(api, chosen);
  EXPECT_NE(std::string(api.error(controller.get())).find("does not tell them apart"),
            std::string::npos)
      << api.error(controller.get());
}

TEST_P(Integration, DropsTheCorrectionInASoftEmergencyStopOnEitherArm) {
  Controller controller = made(CONTROLLER_WITH);
  go_active(controller);
  api.soft_stop(controller.get());
  const float frozen = controller.output().correction_ji[1];
  controller.run(kPedalDown, 300);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_FADING_OUT);
  EXPECT_EQ(controller.output().correction_ji[1], frozen) << "the pedal is still down";
  controller.run(kEStop, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED);
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED) << "until it is homed again";
  controller.home();
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
}

TEST_P(Integration, LeavesTheUnhomingToTheController) {
  for (const bool with_plugin : {false, true}) {
    Controller controller = made(with_plugin ? CONTROLLER_WITH : CONTROLLER_WITHOUT, with_plugin);
    controller.run(kEStop, 20);
    controller.home();
    controller.run(kPedalUp, 500);
    EXPECT_EQ(api.is_homed(controller.get()), 1);
    api.unhome(controller.get());
    controller.run(kPedalUp, 2000);
    if (std::string(api.branch) != "crtk") continue;
    EXPECT_EQ(api.is_homed(controller.get()), 0);
    if (with_plugin) {
      EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED);
    }
  }
}

/// Largest change of the motor commands per cycle, and where the joints went meanwhile.
struct Motion {
  std::array<double, 3> largest_step_rad{};
  std::array<double, 3> moved_ji{};
};

Motion observe_motion(const controller_api& api, Controller& controller, int cycles) {
  Motion motion;
  std::array<float, 3> mpos{};
  std::array<float, 3> before{};
  api.motors(controller.get(), mpos.data(), before.data());
  const std::array<float, 3> start = mpos;
  for (int i = 0; i < cycles; ++i) {
    controller.run(kPedalDown, 1);
    std::array<float, 3> now{};
    api.motors(controller.get(), mpos.data(), now.data());
    for (std::size_t j = 0; j < 3; ++j) {
      const double step = std::fabs(static_cast<double>(now[j] - before[j]));
      motion.largest_step_rad[j] = std::max(motion.largest_step_rad[j], step);
    }
    before = now;
  }
  for (std::size_t j = 0; j < 3; ++j) {
    motion.moved_ji[j] = std::fabs(static_cast<double>(mpos[j] - start[j])) / kReduction[j];
  }
  return motion;
}

TEST_P(Integration, MovesNoMotorThatNobodyCommandsWhateverBecomesOfTheCorrection) {
  const auto other = write_weights(
      [&] {
        model::CalibrationModel model = model_for_home(GetParam().green != 0);
        model.output.mean = Eigen::Vector3d(0.05, 0.03, -0.003);
        return model;
      }(),
      "integration_other");
  const std::vector<std::pair<const char*, std::function<void(Controller&)>>> transitions = {
      {"nothing", [](Controller&) {}},
      {"disabled", [&](Controller& c) { api.enable(c.get(), 0); }},
      {"other weights", [&](Controller& c) { EXPECT_EQ(api.load(c.get(), other.c_str()), 1); }},
      {"soft stop", [&](Controller& c) { api.soft_stop(c.get()); }}};
  for (const auto& [name, act] : transitions) {
    Controller controller = made(CONTROLLER_WITH);
    api.command(controller.get(), 0);
    controller.run(kEStop, 20);
    controller.home();
    controller.run(kPedalUp, 1000);
    controller.run(kPedalDown, 2000);  // friction and weight have settled
    act(controller);
    const Motion motion = observe_motion(api, controller, 3000);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_LT(motion.largest_step_rad[j], kRadPerCount) << name << ", joint " << j + 1;
      EXPECT_LT(motion.moved_ji[j], 2.0 * kRadPerCount / kReduction[j]) << name << ", " << j + 1;
    }
  }
  // A pedal pressed while the correction fades in.
  Controller early = made(CONTROLLER_WITH);
  api.command(early.get(), 0);
  early.run(kEStop, 20);
  early.home();
  early.run(kPedalUp, 115);
  ASSERT_EQ(early.output().state, RAVENCAL_STATE_FADING_IN);
  early.run(kPedalDown, 500);
  EXPECT_NE(early.output().offset_ji[1], 0.0F);
  const Motion motion = observe_motion(api, early, 3000);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_LT(motion.largest_step_rad[j], kRadPerCount);
}

TEST_P(Integration, BlendsAnOffsetAwayWithTheMotionThatTheOperatorCommands) {
  Controller early = made(CONTROLLER_WITH);
  api.command(early.get(), 0);
  early.run(kEStop, 20);
  early.home();
  early.run(kPedalUp, 115);
  early.run(kPedalDown, 500);
  const float offset = std::fabs(early.output().offset_ji[1]);
  ASSERT_GT(offset, 0.001F);
  early.run(kPedalDown, 1000);
  EXPECT_EQ(std::fabs(early.output().offset_ji[1]), offset) << "nobody moves the arm";
  api.command(early.get(), 1);
  early.run(kPedalDown, 20000);
  EXPECT_LT(std::fabs(early.output().offset_ji[1]), 0.2F * offset);
}

TEST_P(Integration, SeesJointsReadyOneByOneWithTheirState) {
  Controller controller = made(CONTROLLER_WITH);
  controller.run(kEStop, 20);
  EXPECT_EQ(controller.seen().arm[0].joints_ready, 0U);
  api.begin_homing(controller.get());
  controller.run(kInit, 1100);
  EXPECT_EQ(controller.seen().arm[0].joints_ready, 0U);
  controller.run(kInit, 400);
  EXPECT_EQ(controller.seen().arm[0].joints_ready, 0xFFU);
  EXPECT_EQ(controller.seen().arm[1].joints_ready, 0xFFU);
}

TEST_P(Integration, CorrectsTheCalibratedArmOnlyAndFromHomingToEStop) {
  Controller with = made(CONTROLLER_WITH);
  with.run(kEStop, 20);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ARMED);
  with.home();
  for (const float correction : with.output().correction_ji) EXPECT_EQ(correction, 0.0F);
  with.run(kPedalUp, 3000);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ACTIVE);
  with.run(kPedalDown, 500);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ACTIVE);
  std::array<float, 3> jpos{};
  std::array<float, 3> jpos_d{};
  api.joints(with.get(), jpos.data(), jpos_d.data());
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_EQ(jpos[j], with.output().jpos_ji[j]) << "written back";
    EXPECT_NE(with.output().correction_ji[j], 0.0F);
  }
  EXPECT_NEAR(with.output().correction_ji[1], -0.03, 0.005);

  with.run(kEStop, 1000);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ARMED);
  for (const float correction : with.output().correction_ji) EXPECT_EQ(correction, 0.0F);
  with.home();
  with.run(kPedalUp, 3000);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ACTIVE) << "again, after re-homing";
}

TEST_P(Integration, LeavesTheOtherArmAlone) {
  Controller with = made(CONTROLLER_WITH);
  Controller without = made(CONTROLLER_WITHOUT, false);
  for (Controller* controller : {&with, &without}) {
    controller->run(kEStop, 20);
    controller->home();
    controller->run(kPedalUp, 3000);
    controller->run(kPedalDown, 500);
  }
  host::CatalogueValues a{};
  host::CatalogueValues b{};
  api.published(with.get(), a.data());
  api.published(without.get(), b.data());
  const std::size_t own = GetParam().green != 0 ? 8 : 0;
  const std::size_t other = 8 - own;
  for (std::size_t j = 0; j < 8; ++j) {
    for (const std::size_t field : {1U, 70U, 86U, 102U, 118U, 166U, 182U}) {
      EXPECT_EQ(a[field + other + j], b[field + other + j]) << field << " " << j;
    }
    EXPECT_EQ(a[1 + own + j] != b[1 + own + j], j < 3) << "joints 1 to 3 differ, the tool does not";
  }
}

/// Largest distance between desired and actual motors while the pedal is up: the step to come.
std::array<double, 3> motor_error_while_pedal_is_up(const controller_api& api, Controller& c) {
  std::array<double, 3> worst{};
  for (int i = 0; i < 200; ++i) {
    c.run(kPedalUp, 1);
    std::array<float, 3> mpos{};
    std::array<float, 3> mpos_d{};
    api.motors(c.get(), mpos.data(), mpos_d.data());
    for (std::size_t j = 0; j < 3; ++j) {
      worst[j] = std::max(worst[j], std::fabs(static_cast<double>(mpos_d[j] - mpos[j])));
    }
  }
  return worst;
}

TEST_P(Integration, ReseedsDesiredFromActualWithinOneEncoderCountOfTheMotor) {
  Controller both_ways = made(CONTROLLER_WITH);
  go_active(both_ways);
  for (const double error : motor_error_while_pedal_is_up(api, both_ways)) {
    EXPECT_LT(error, kRadPerCount);
  }
  // The same controller without the lines in the inverse path: what the pair is there for.
  Controller one_way = made(CONTROLLER_ONE_WAY);
  one_way.run(kEStop, 20);
  one_way.home();
  one_way.run(kPedalUp, 3000);
  ASSERT_EQ(one_way.output().state, RAVENCAL_STATE_ACTIVE);
  const auto alarm = motor_error_while_pedal_is_up(api, one_way);
  EXPECT_GT(alarm[0], 1000.0 * kRadPerCount);
}

TEST_P(Integration, IsBitForBitTheControllerBeforeWhereItIsUndoneOrOff) {
  Controller before = made(CONTROLLER_WITHOUT, false);
  Controller not_opened = made(CONTROLLER_WITH, false);
  Controller off = made(CONTROLLER_WITH);
  api.enable(off.get(), 0);
  const controller_setup wrong{
      CONTROLLER_WITH, "/nonexistent/plugin.so", nullptr, nullptr, GetParam().green, 0, 0};
  Controller refused(api, wrong);
  EXPECT_NE(std::string(api.error(refused.get())).find("cannot be loaded"), std::string::npos);
  const controller_setup damaged{
      CONTROLLER_WITH, RAVENCAL_PLUGIN_PATH, "/nonexistent.blob", nullptr, GetParam().green, 0, 0};
  Controller without_weights(api, damaged);
  EXPECT_NE(std::string(api.error(without_weights.get())).find("/nonexistent.blob"),
            std::string::npos);
  const auto all = [&](const std::function<void(Controller&)>& act) {
    for (Controller* c : {&before, &not_opened, &off, &refused, &without_weights}) act(*c);
    const std::string wanted = before.bytes();
    EXPECT_TRUE(not_opened.bytes() == wanted);
    EXPECT_TRUE(off.bytes() == wanted);
    EXPECT_TRUE(refused.bytes() == wanted);
    EXPECT_TRUE(without_weights.bytes() == wanted);
  };
  for (int round = 0; round < 2; ++round) {
    all([](Controller& c) { c.run(kEStop, 20); });
    all([&](Controller& c) { api.begin_homing(c.get()); });
    for (int i = 0; i < 1500; ++i) all([](Controller& c) { c.run(kInit, 1); });
    for (int i = 0; i < 300; ++i) all([](Controller& c) { c.run(kPedalUp, 1); });
    for (int i = 0; i < 1000; ++i) all([](Controller& c) { c.run(kPedalDown, 1); });
    all([&](Controller& c) { round == 0 ? api.unhome(c.get()) : api.soft_stop(c.get()); });
    for (int i = 0; i < 100; ++i) all([](Controller& c) { c.run(kPedalDown, 1); });
  }
}

TEST_P(Integration, TakesNewWeightsWhileItRunsAndKeepsTheOldOnesOnARefusal) {
  Controller controller = made(CONTROLLER_WITH);
  go_active(controller);
  EXPECT_EQ(api.load(controller.get(), "/nonexistent.blob"), 0);
  controller.run(kPedalDown, 10);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
  model::CalibrationModel model = model_for_home(GetParam().green != 0);
  model.output.mean = Eigen::Vector3d(0.03, -0.03, 0.002);
  EXPECT_EQ(api.load(controller.get(), write_weights(model, "integration_new").c_str()), 1);
  controller.run(kPedalDown, 100);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_FADING_IN) << "bumpless: by its motion";
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
  EXPECT_NEAR(controller.output().correction_ji[0], 0.03, 0.005);
}

}  // namespace
}  // namespace ravencal::test
