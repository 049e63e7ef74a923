// SPDX-License-Identifier: Apache-2.0
//
// What the adapter sees and refuses: every field in its slot and unit as a recording holds it, arms
// and joints as the controller tells them apart, weights of the right arm.
#include <cmath>

#include "physics/raven_kinematics.hpp"
#include "plugin_host/robot_state.hpp"
#include "unit/integration_rig.hpp"

namespace ravencal::test {
namespace {

INSTANTIATE_TEST_SUITE_P(EveryBranch, Integration, every_branch(), name_of_case);

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
  plugin_host::CatalogueValues message{};
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
  plugin_host::fill_state(plugin_host::to_si(message), controller.seen().t_ns, true, state);
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

TEST_P(Integration, RefusesWeightsOfTheOtherArmAndTakesTheRightOnesLater) {
  controller_setup chosen = setup(CONTROLLER_WITH);
  const auto wrong = write_weights(model_for_home(GetParam().green == 0), "wrong_arm");
  chosen.weights = wrong.c_str();
  Controller controller(api, chosen);
  EXPECT_NE(std::string(api.error(controller.get())).find("was trained for the"), std::string::npos)
      << api.error(controller.get());
  controller.run(kEmergencyStop, 20);
  controller.home();
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED);
  for (const float correction : controller.output().correction_ji) EXPECT_EQ(correction, 0.0F);
  EXPECT_EQ(api.load(controller.get(), weights.c_str()), 1) << api.error(controller.get());
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
}

TEST_P(Integration, ReadsNoJacobianBeforeTheControllerHasComputedOne) {
  Controller controller = made(CONTROLLER_WITH);
  controller.run(kEmergencyStop, 5);
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

TEST_P(Integration, CorrectsNoArmWhoseJointsArePublishedInAnotherSlot) {
  controller_setup chosen = setup(CONTROLLER_WITH);
  chosen.wrong_slot = 1;
  // Weights of the arm that the wrong slot names.
  const auto wrong = write_weights(model_for_home(GetParam().green == 0), "wrong_slot");
  chosen.weights = wrong.c_str();
  Controller controller(api, chosen);
  EXPECT_EQ(std::string(api.error(controller.get())), "") << "the joints have no types yet";
  controller.run(kEmergencyStop, 20);
  controller.home();
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED);
  for (const float correction : controller.output().correction_ji) EXPECT_EQ(correction, 0.0F);
  EXPECT_EQ(api.arms_agree(controller.get()), 0);
  EXPECT_NE(std::string(api.error(controller.get())).find("published in slot"), std::string::npos)
      << api.error(controller.get());
}

TEST_P(Integration, RefusesTwoArmsWithOneSlotAndLimitsThatAreMissing) {
  const std::array<std::pair<int, const char*>, 3> faults = {
      {{SETTINGS_ONE_SLOT, "both arms have message_slot"},
       {SETTINGS_NO_LIMITS, "limits of joint 1 are missing"},
       {SETTINGS_NO_CENTRE, "remote_centre_radius_m is missing"}}};
  for (const auto& [fault, sentence] : faults) {
    controller_setup chosen = setup(CONTROLLER_WITH);
    chosen.fault = fault;
    const Controller controller(api, chosen);
    EXPECT_NE(std::string(api.error(controller.get())).find(sentence), std::string::npos)
        << api.error(controller.get());
  }
}

TEST_P(Integration, GoesOnAfterTooManyOverrunsOnceItIsReset) {
  controller_setup chosen = setup(CONTROLLER_WITH);
  chosen.step_budget_ns = 1;  // every step is longer
  Controller controller(api, chosen);
  controller.run(kEmergencyStop, 20);
  controller.home();
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().doubts, RAVENCAL_DOUBT_OVERRUN);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED) << "no correction begins";
  api.reset(controller.get());
  controller.run(kPedalUp, 1);
  EXPECT_EQ(controller.output().doubts, 0U);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_OFF) << "until it is enabled again";
}

TEST_P(Integration, SeesJointsReadyOneByOneWithTheirState) {
  Controller controller = made(CONTROLLER_WITH);
  controller.run(kEmergencyStop, 20);
  EXPECT_EQ(controller.seen().arm[0].joints_ready, 0U);
  api.begin_homing(controller.get());
  controller.run(kInit, 2100);
  EXPECT_EQ(controller.seen().arm[0].joints_ready, 0U);
  controller.run(kInit, 400);
  EXPECT_EQ(controller.seen().arm[0].joints_ready, 0xFFU);
  EXPECT_EQ(controller.seen().arm[1].joints_ready, 0xFFU);
}

}  // namespace
}  // namespace ravencal::test
