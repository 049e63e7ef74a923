// SPDX-License-Identifier: Apache-2.0
//
// A controller in miniature with the adapter's lines, of both branches, as old and as new C++, as
// the integration tests drive it.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <memory>
#include <string>

#include "core/run_level.hpp"
#include "rt/rig.hpp"
#include "unit/integration_controller.h"

extern "C" {
const controller_api* controller_main_98(void);
const controller_api* controller_main_17(void);
const controller_api* controller_crtk_98(void);
const controller_api* controller_crtk_17(void);
}

namespace ravencal::test {

using enum core::RunLevel;
inline constexpr double kRadPerCount = 2.0 * 3.14159265358979 / 4000.0;
inline constexpr std::array<double, 3> kReduction = {136.196, 121.522, 2158.59};

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
    api_.press(get(), runlevel == kPedalDown ? 1 : 0);
    for (int i = 0; i < cycles; ++i) api_.cycle(get(), runlevel);
  }
  void home() {
    api_.begin_homing(get());
    run(kEmergencyStop, 5);  // takes the command to home
    run(kInit, 2500);
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
inline model::CalibrationModel model_for_home(bool green) {
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
            0,
            0,
            0,
            500000000,
            0};
  }
  [[nodiscard]] Controller made(int lines, bool with_plugin = true) const {
    const controller_setup chosen = setup(lines, with_plugin);
    return {api, chosen};
  }
  void go_active(Controller& controller) {
    controller.run(kEmergencyStop, 20);
    controller.home();
    controller.run(kPedalUp, 1000);
    ASSERT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
    controller.run(kPedalDown, 500);
  }

  const controller_api& api;
  const std::filesystem::path weights;
};

/// Both branches, either arm, either language.
inline auto every_branch() {
  return ::testing::Values(
      Case{"main_98_gold", controller_main_98, 0}, Case{"main_98_green", controller_main_98, 1},
      Case{"main_17_gold", controller_main_17, 0}, Case{"crtk_98_gold", controller_crtk_98, 0},
      Case{"crtk_98_green", controller_crtk_98, 1}, Case{"crtk_17_green", controller_crtk_17, 1});
}
inline std::string name_of_case(const ::testing::TestParamInfo<Case>& which) {
  return which.param.name;
}

}  // namespace ravencal::test
