// SPDX-License-Identifier: Apache-2.0
//
// plant_text is the way back of parse_plant.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/whole_file.hpp"
#include "physics/effects/effect_spec.hpp"
#include "physics/plant.hpp"
#include "physics/plant_ranges.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::physics {
namespace {

/// What parse_plant makes of the plant's text, said to be of the plant's file.
Plant read_back(const Plant& plant) {
  auto again = parse_plant(plant_text(plant), plant.source);
  EXPECT_TRUE(again.ok()) << (again.ok() ? "" : again.error().message) << "\n" << plant_text(plant);
  Plant read = again.ok() ? std::move(again).value() : Plant{};
  read.source = plant.source;
  read.hash = plant.hash;
  return read;
}

Plant shipped(const std::string& file) {
  auto plant =
      load_plant(std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tools/plants" / (file + ".toml"));
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

std::vector<std::string> shipped_plants() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(RAVENCAL_SOURCE_DIR) / "tools/plants"))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class ShippedPlant : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedPlant, ReadsBackFromItsTextAsItWas) {
  const Plant plant = shipped(GetParam());
  EXPECT_EQ(read_back(plant), plant) << plant_text(plant);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedPlant, ::testing::ValuesIn(shipped_plants()),
                         [](const auto& instance) { return instance.param; });

TEST(PlantText, LeavesOutWhatAPlantDoesNotHave) {
  const std::string text = plant_text(shipped("dvrk_jhu_tracker"));
  EXPECT_EQ(text.substr(0, text.find("[[joint]]")), R"([robot]
name = "dvrk_jhu_tracker"
control_rate_hz = 1000.0
inner_rate_hz = 10000.0
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]

)");
  EXPECT_EQ(text.substr(text.rfind("[[joint]]")), R"([[joint]]
name = "z"
kind = "prismatic"
motor_inertia_kg_m2 = 1e-05
gearbox_ratio = 1.0
reduction_rad_per_m = 1.0
joint_encoder_resolution_m = 1e-06
)");
}

TEST(PlantText, HasTheTablesOfAJointInTheOrderOfTheShippedPlants) {
  const std::string text = plant_text(shipped("raven2"));
  std::size_t at = 0;
  for (const char* header :
       {"coupling = [\n  [0.0, 0.0, 0.0],\n  [-0.14545, 0.0, 0.0],", "[robot]", "[logger]",
        "[[joint]]", "  [joint.link]", "  [joint.drive]", "  [joint.controller]",
        "  [joint.homing]",
        "  [[joint.effect]]\n  id = \"homing_offset\"\n  deviation_rad = 0.001\n", "[[joint]]",
        "  id = \"coupling\"\n  from = \"shoulder\"\n"}) {
    const std::size_t next = text.find(header, at);
    ASSERT_NE(next, std::string::npos) << header << "\n" << text;
    at = next + 1;
  }
}

/// Keys and texts are data of the owner, and every number may be one that decimal digits or
/// integers would not carry.
TEST(PlantText, KeepsWhatIsHardToWrite) {
  Plant plant = shipped("raven2");
  plant.robot.name = "a \"quoted\" \\ name\tof\ntwo lines, \x7f and \xc3\xa9";
  plant.robot.arm = "green";
  plant.robot.controller = *find_controller_branch("crtk");
  plant.payload = {0.1 + 0.2, {-0.0, 5e-324, 99.99999999999999}};
  plant.sensors.motor_encoder_counts_per_rev = 123456789.00000001;
  plant.joints[0].controller->gravity_compensation = true;
  plant.joints[0].homing.reset();
  plant.joints[0].tolerance = {{"stiffness", 1.0 / 3.0}, {"creep.time", 0.0}};
  plant.joints[1].controller.reset();
  plant.joints[1].limits = {-1.0 / 3.0, {}, 5e-9};
  plant.joints[2].limits = {{}, 0.1 + 0.2, {}};
  plant.joints[1].drive = {"current_a", -2.5, 1e-22};
  plant.joints[2].effects = {{"hysteresis", "elbow", {{"half_loop", 0.1}, {"width", 0.2}}},
                             {"compliance", "force", {{"stretch_per_load", 0.1}}},
                             {"compliance",
                              "force",
                              {{"stretch_per_load", 0.0}, {"stretch_per_load_and_posture", 3.0}},
                              "elbow"}};
  const Plant read = read_back(plant);
  EXPECT_EQ(read, plant) << plant_text(plant);
  EXPECT_TRUE(std::signbit(read.payload.com_m[0]));
}

TEST(PlantText, KeepsARecorderOfDefaultsApartFromNone) {
  Plant plant = shipped("emps");
  EXPECT_FALSE(read_back(plant).logger.given);
  plant.logger.given = true;
  EXPECT_TRUE(read_back(plant).logger.given);
}

TEST(EffectFlaws, AreWhatNoPlantMayHave) {
  EXPECT_EQ(flaw_of({"stribeck_friction", "", {{"extra", 1.0}, {"velocity", 0.1}}}), "");
  EXPECT_NE(flaw_of({"stribeck_friction", "", {{"extra", 1.0}}}).find("velocity"),
            std::string::npos);
  EXPECT_NE(flaw_of({"backlash", "elbow", {{"half_width", 1.0}}}).find("from"), std::string::npos);
  EXPECT_NE(flaw_of({"joint_friction", "", {{"level", 1.0}}}).find("presliding"),
            std::string::npos);
}

TEST(Plant, HasItsRangesInTheTableOfTheFormats) {
  const auto formats = core::read_whole_file(RAVENCAL_SOURCE_DIR "/shared/FORMATS.md");
  ASSERT_TRUE(formats.ok());
  const std::pair<const char*, core::NumberRange> rows[] = {
      {"positions (`tool_joints_rad`, `stop_*`, `home_*`, `low_*`, `high_*`)", kPositionRange},
      {"`speed_*` of `[joint.homing]`", kVelocityRange},
      {"`speed_*` of `[joint.limits]`", kSpeedRange},
      {"stiffnesses (`kp_*`, `stop_stiffness_*`)", kStiffnessRange},
      {"dampings (`kd_*`, `stop_damping_*`)", kDampingRange},
      {"counts (`dac_limit_counts`, `dac_threshold_counts`, `rehoming_shift_counts`)",
       kCountsRange},
      {"`mass_kg`", kMassRange},
      {"`inertia_kg_m2`", kInertiaRange},
      {"`motor_inertia_kg_m2`", kRotorRange},
      {"`com_m`, `position_m`", kLengthRange},
      {"`rotation_wxyz`, `axis` (made units)", kDirectionRange},
      {"`gravity_m_per_s2`", kGravityRange},
      {"`gearbox_ratio`, `reduction`, `reduction_rad_per_m`", kTransmissionRange},
      {"`gain`, `dac_counts_per_n_m`", kGainRange},
      {"`encoder_sign`", kSignRange},
      {"`joint_encoder_resolution_*`", kResolutionRange},
      {"`motor_encoder_counts_per_rev`", kCountsPerRevRange},
      {"`control_rate_hz`", kControlRateRange},
      {"`inner_rate_hz`", kInnerRateRange},
      {"`rate_hz`", kRowRateRange},
      {"`truth_period_s`", kPeriodRange},
      {"`truth_latency_s`, `truth_latency_deviation_s`", kLatencyRange},
      {"tolerances", kToleranceRange},
      {"`coupling`", kCouplingRange},
  };
  for (const auto& [numbers, range] : rows) {
    const std::string row = fmt::format("| {} | {:g} | {:g} |", numbers, range.low, range.high);
    EXPECT_NE(formats->find(row), std::string::npos) << row;
  }
}

}  // namespace
}  // namespace ravencal::physics
