// SPDX-License-Identifier: Apache-2.0
//
// Plants written back into the robot models of others.
#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>

#include "core/whole_file.hpp"
#include "physics/effects/effect_spec.hpp"
#include "physics/predict/predict.hpp"
#include "physics/robot_model/body_places.hpp"
#include "physics/robot_model/effects_in_models.hpp"
#include "physics/robot_model/robot_file.hpp"
#include "physics/robot_model/robot_writer.hpp"
#include "unit/run_command.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::VectorXd;

constexpr const char* kMjcf = R"(<?xml version="1.0"?>
<!-- of others -->
<mujoco model="two joints">
  <compiler meshdir="meshes"/>
  <asset><mesh name="cover" file="cover.stl"/></asset>
  <default><joint damping="0.2" armature="0.02"/><default class="soft"><joint damping="0.1"/></default></default>
  <worldbody>
    <body name="upper">
      <!-- the first one -->
      <joint name="pan" axis="0 1 0" frictionloss="0.1" range="-90 90"/>
      <inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.002"/>
      <geom type="mesh" mesh="cover"/>
      <body name="fore" pos="0 0 -0.4" childclass="soft">
        <joint name="elbow" axis="0 1 0"/>
        <inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.004 0.004 0.001"/>
      </body>
    </body>
    <include file="column.xml"/>
  </worldbody>
  <equality><joint joint1="lift" joint2="pan" polycoef="0 0.1 0 0 0"/></equality>
  <actuator><motor name="m" joint="pan" gear="2"/><position name="p" joint="elbow" kp="30"/></actuator>
  <keyframe><key qpos="0.1 0.2 0.3" qvel="1 2 3"/></keyframe>
</mujoco>)";

constexpr const char* kColumn = R"(<mujocoinclude>
  <body name="column"><joint name="lift" type="slide"/>
    <inertial pos="0 0 0" mass="2" diaginertia="0.1 0.1 0.1"/></body>
</mujocoinclude>)";

constexpr const char* kUrdf = R"(<robot name="r"><link name="base"/>
  <link name="a"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="plate"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="bolts" type="fixed"><parent link="a"/><child link="plate"/></joint>
  <joint name="swing" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="5" velocity="2"/>
    <dynamics damping="0.3" friction="0.1"/></joint></robot>)";

class RobotWriter : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "out");
    std::ofstream(folder_ / "robot.xml") << kMjcf;
    std::ofstream(folder_ / "column.xml") << kColumn;
    std::ofstream(folder_ / "robot.urdf") << kUrdf;
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] Plant given(const char* model = "robot.xml") const {
    const auto plant = load_plant(folder_ / model);
    EXPECT_TRUE(plant.ok()) << plant.error().message;
    return *plant;
  }
  /// What the model becomes; it lies in out/.
  [[nodiscard]] WrittenRobot written(const Plant& plant, const char* model = "robot.xml") const {
    const auto written = write_robot(plant, folder_ / model, folder_ / "out" / model);
    EXPECT_TRUE(written.ok()) << written.error().message;
    if (!written.ok()) return {};
    std::ofstream(folder_ / "out" / model) << written->text;
    return *written;
  }
  [[nodiscard]] std::string refusal(const Plant& plant) const {
    const auto written = write_robot(plant, folder_ / "robot.xml", folder_ / "out/robot.xml");
    return written.ok() ? "none" : written.error().message;
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("robot_writer_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

std::string joined(const std::vector<std::string>& lines) {
  return fmt::format("{}", fmt::join(lines, "\n"));
}
bool has(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

void add(Plant& plant, std::size_t joint, const Effect& effect) {
  plant.joints[joint].effects.push_back(effect);
}

TEST_F(RobotWriter, LeavesAloneWhatThePlantDoesNotChange) {
  const WrittenRobot same = written(given());
  EXPECT_TRUE(same.changed.empty()) << joined(same.changed);
  EXPECT_TRUE(same.not_expressed.empty()) << joined(same.not_expressed);
  EXPECT_TRUE(same.callback.empty());
  for (const char* kept :
       {"<!-- of others -->", "<!-- the first one -->", "class=\"soft\"", "range=\"-90 90\"",
        "<joint name=\"elbow\" axis=\"0 1 0\"/>", "mesh=\"cover\"", "name=\"column\"",
        "qpos=\"0.1 0.2 0.3\"", "The 1 files that it includes stand in it"})
    EXPECT_TRUE(has(same.text, kept)) << kept << "\n" << same.text;
  // From out/ the meshes are elsewhere.
  EXPECT_TRUE(has(same.text, "meshdir=\"../meshes\"")) << same.text;
}

TEST_F(RobotWriter, WritesNumbersAtTheElementsThatHaveThem) {
  Plant plant = given();
  plant.joints[0].effects.clear();
  add(plant, 0, {"coulomb_friction", "", {{"level", 0.30000000000000004}}});
  add(plant, 0, {"joint_friction", "", {{"level", 0.1}, {"presliding", 1e-4}}});
  add(plant, 0, {"torque_constant", "", {{"ratio", 0.25}}});
  plant.joints[1].motor_inertia_kg_m2 = 0.1 + 0.2;
  plant.joints[1].link.mass_kg = 0.7;
  plant.joints[1].controller->kp_n_m_per_rad = 33.0;
  add(plant, 2, {"coupling", "pan", {{"error", 0.5}}});
  const WrittenRobot changed = written(plant);
  EXPECT_TRUE(changed.not_expressed.empty()) << joined(changed.not_expressed);
  for (const char* part :
       {"<joint name=\"pan\" axis=\"0 1 0\" frictionloss=\"0.4\" range=\"-90 90\" damping=\"0\"/>",
        "armature=\"0.30000000000000004\"", "pos=\"0 0 -0.1\" mass=\"0.7\" diaginertia=\"0.004",
        "<motor name=\"m\" joint=\"pan\" gear=\"2.5\"/>", "joint=\"elbow\" kp=\"33\"",
        "polycoef=\"0 0.6 0 0 0\""})
    EXPECT_TRUE(has(changed.text, part)) << part << "\n" << changed.text;
}

TEST_F(RobotWriter, PutsPlayAndStretchBehindTheJointOfTheDrive) {
  Plant plant = given();
  add(plant, 0, {"backlash", "", {{"half_width", 0.01}}});
  add(plant, 1, {"compliance", "", {{"stiffness", 200.0}, {"damping", 0.5}}});
  const WrittenRobot changed = written(plant);
  EXPECT_TRUE(has(changed.text, "qpos=\"0.1 0 0.2 0 0.3\" qvel=\"1 0 2 0 3\"")) << changed.text;
  EXPECT_TRUE(has(changed.text, "Joint pan is where its drive is")) << changed.text;
  const auto again = load_plant(folder_ / "out/robot.xml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  ASSERT_EQ(again->joints.size(), 3U);
  EXPECT_EQ(again->joints[0].parameter("backlash", "half_width"), 0.01);
  EXPECT_EQ(again->joints[1].parameter("compliance", "stiffness"), 200.0);
  EXPECT_EQ(again->joints[1].parameter("compliance", "damping"), 0.5);
  // Of the class soft, the inserted joint takes nothing over.
  EXPECT_TRUE(has(changed.text, "name=\"elbow_cable\"")) << changed.text;
  // Written once more, the joints that are there change.
  plant.joints[0].effects.back().parameters["half_width"] = 0.02;
  const auto wider = write_robot(plant, folder_ / "out/robot.xml", folder_ / "out/wider.xml");
  ASSERT_TRUE(wider.ok()) << wider.error().message;
  EXPECT_EQ(wider->changed.size(), 1U) << joined(wider->changed);
}

/// Drives and the shoulder's link, where springs that hold the drives let them come to rest: rad.
struct AtRest {
  double pan = 0.0, behind_pan = 0.0, elbow = 0.0;
};

AtRest at_rest(mjModel& model) {
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(&model), &mj_deleteData);
  const int pan = mj_name2id(&model, mjOBJ_JOINT, "pan");
  const int elbow = mj_name2id(&model, mjOBJ_JOINT, "elbow");
  constexpr double kHold_n_m_per_rad = 400.0, kPan_rad = 1.0, kElbow_rad = -0.2;
  model.dof_damping[pan] = model.dof_damping[elbow] = 40.0;
  data->qpos[pan] = kPan_rad;
  for (int step = 0; step < 10'000; ++step) {
    data->qfrc_applied[pan] = kHold_n_m_per_rad * (kPan_rad - data->qpos[pan]);
    data->qfrc_applied[elbow] = kHold_n_m_per_rad * (kElbow_rad - data->qpos[elbow]);
    mj_step(&model, data.get());
  }
  return {data->qpos[pan], Eigen::Map<VectorXd>(data->qpos + pan + 1, elbow - pan - 1).sum(),
          data->qpos[elbow]};
}

TEST_F(RobotWriter, ComesToRestWhereGapAndSpringLetItHang) {
  const Effect gap{"backlash", "", {{"half_width", 0.02}}};
  const Effect spring{"compliance", "", {{"stiffness", 200.0}, {"damping", 0.5}}};
  for (const auto& effects : {std::vector{gap}, {spring}, {gap, spring}}) {
    Plant plant = given();
    for (const Effect& effect : effects) add(plant, 0, effect);
    const WrittenRobot changed = written(plant);
    const auto robot = read_robot_file(folder_ / "out/robot.xml");
    ASSERT_TRUE(robot.ok()) << robot.error().message;
    const AtRest rest = at_rest(*robot->model);
    ForcedMotion forced;
    constexpr Index kRows = 50;
    forced.t_s = VectorXd::LinSpaced(kRows, 0.0, 5.0);
    forced.fresh.assign(kRows, 0);
    for (const double position : {rest.pan, rest.elbow, 0.0})
      forced.motors.push_back(
          {VectorXd::Constant(kRows, position), VectorXd::Zero(kRows), VectorXd::Zero(kRows), 0.0});
    const auto predicted = predict(plant, forced);
    ASSERT_TRUE(predicted.ok());
    const double wanted_rad = predicted->hanging[0][kRows - 1] - rest.pan;
    EXPECT_NEAR(rest.behind_pan, wanted_rad, 0.02 * std::abs(wanted_rad)) << changed.text;
  }
  Plant plant = given();
  plant.joints[0].motor_inertia_kg_m2 = 1e-12;
  add(plant, 0, gap);
  EXPECT_TRUE(has(joined(written(plant).not_expressed), "pan: an inertia of its drive"));
}

TEST_F(RobotWriter, WritesUrdfAndListsWhatItCannotSay) {
  Plant plant = given("robot.urdf");
  plant.joints[0].effects.clear();
  add(plant, 0, {"coulomb_friction", "", {{"level", 0.4}}});
  add(plant, 0, {"backlash", "", {{"half_width", 0.01}}});
  add(plant, 0, {"stribeck_friction", "", {{"extra", 0.1}, {"velocity", 0.1}}});
  plant.joints[0].motor_inertia_kg_m2 = 0.05;
  plant.joints[0].link.mass_kg *= 1.5;
  plant.payload = {0.3, {0.2, 0.0, 0.1}};
  const WrittenRobot changed = written(plant, "robot.urdf");
  EXPECT_TRUE(has(changed.text, "<dynamics damping=\"0\" friction=\"0.4\"/>")) << changed.text;
  EXPECT_TRUE(changed.callback.empty());
  for (const char* missing : {"backlash", "stribeck_friction", "motor_inertia"})
    EXPECT_TRUE(has(joined(changed.not_expressed), missing)) << joined(changed.not_expressed);
  EXPECT_TRUE(has(joined(changed.not_expressed), "mj_saveLastXML"));
  const auto again = load_plant(folder_ / "out/robot.urdf");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_NEAR(again->joints[0].link.mass_kg, 1.5 * 2.5 + 0.3, 1e-12);
}

TEST_F(RobotWriter, PutsAJointWhereThePlantHasIt) {
  for (const char* model : {"robot.xml", "robot.urdf"}) {
    Plant plant = given(model);
    Frame& frame = *plant.joints.back().frame;
    frame.position_m[0] += 0.03;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(pose_of(frame).linear()) *
                                    Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY());
    frame.rotation = {turn.w(), turn.x(), turn.y(), turn.z()};
    EXPECT_EQ(written(plant, model).changed.size(), 1U) << model;
    EXPECT_TRUE(
        same_frame(*given(("out/" + std::string(model)).c_str()).joints.back().frame, frame))
        << model;
  }
}

TEST_F(RobotWriter, RefusesAPlantOfAnotherModel) {
  Plant renamed = given();
  renamed.joints[0].name = "tilt";
  EXPECT_TRUE(has(refusal(renamed), "another joint or axis at 'tilt'")) << refusal(renamed);
  Plant shorter = given();
  shorter.joints.pop_back();
  EXPECT_TRUE(has(refusal(shorter), "more or fewer joints")) << refusal(shorter);
  Plant turned = given();
  turned.joints[1].frame->axis = {0.6, 0.0, 0.8};
  EXPECT_TRUE(has(refusal(turned), "another joint or axis at 'elbow'")) << refusal(turned);
  EXPECT_EQ(refusal(given()), "none");
}

/// A size for each parameter that an effect needs; from the shoulder where it needs a source.
Effect sample(const EffectSpec& spec) {
  Effect effect{std::string(spec.id), spec.id == "coupling" ? "pan" : "", {}};
  for (const ParameterSpec& p : spec.parameters)
    if (p.required) effect.parameters.emplace(std::string(p.name), 0.01);
  for (const char* needed : {"level", "presliding", "stiffness", "damping", "yield", "offset",
                             "final", "level_difference"})
    for (const ParameterSpec& p : spec.parameters)
      if (p.name == needed) effect.parameters.emplace(needed, 0.01);
  return effect;
}

/// The table says of every effect what the writer does with it.
TEST_F(RobotWriter, DoesWithEachEffectWhatTheTableSays) {
  ASSERT_EQ(effects_in_models().size(), effect_specs().size());
  for (std::size_t i = 0; i < effect_specs().size(); ++i) {
    const EffectSpec& spec = effect_specs()[i];
    const EffectInModels& row = effects_in_models()[i];
    ASSERT_EQ(row.id, spec.id);
    const Effect effect = sample(spec);
    ASSERT_EQ(flaw_of(effect), "");
    Plant plant = given();
    // The column is coupled to the shoulder; the elbow has an actuator.
    const std::size_t joint = spec.id == "coupling" ? 2 : 1;
    std::erase_if(plant.joints[joint].effects, [&](const Effect& e) { return e.id == spec.id; });
    add(plant, joint, effect);
    const WrittenRobot mjcf = written(plant);
    EXPECT_EQ(mjcf.changed.empty(), row.mjcf.empty()) << row.id << joined(mjcf.changed);
    EXPECT_EQ(mjcf.not_expressed.empty(), !row.mjcf.empty()) << row.id;
    EXPECT_EQ(mjcf.callback.empty(), !row.in_callback) << row.id;
    const auto again = load_plant(folder_ / "out/robot.xml");
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(again->joints[joint].find_effect(spec.id) != nullptr, !row.read_from.empty())
        << row.id;
    if (spec.id == "coupling") continue;
    Plant other = given("robot.urdf");
    std::erase_if(other.joints[0].effects, [&](const Effect& e) { return e.id == spec.id; });
    add(other, 0, effect);
    const WrittenRobot urdf = written(other, "robot.urdf");
    EXPECT_EQ(urdf.changed.empty(), row.urdf.empty()) << row.id << joined(urdf.changed);
  }
}

TEST_F(RobotWriter, IsDocumentedEffectByEffect) {
  const auto formats = core::read_whole_file(fs::path(RAVENCAL_SOURCE_DIR) / "shared/FORMATS.md");
  ASSERT_TRUE(formats.ok());
  const auto cell = [](std::string_view words) {
    return words.empty() ? std::string() : fmt::format("{} ", words);
  };
  for (const EffectInModels& row : effects_in_models()) {
    const std::string line =
        fmt::format("| `{}` | {}| {}| {}| {}| {}|\n", row.id, cell(row.read_from), cell(row.mjcf),
                    cell(row.in_callback ? "yes" : ""), cell(row.urdf), cell(row.remark));
    EXPECT_TRUE(has(*formats, line)) << line;
  }
}

/// Shoulder and elbow with all effects that a callback adds.
Plant with_callback_effects(Plant plant) {
  for (std::size_t j : {0U, 1U}) {
    std::erase_if(plant.joints[j].effects,
                  [](const Effect& e) { return e.id == "coulomb_friction"; });
    add(plant, j, {"coulomb_friction", "", {{"level", 0.3}}});
    add(plant, j, {"stribeck_friction", "", {{"extra", 0.2}, {"velocity", 0.1}}});
    add(plant, j, {"presliding", "", {{"displacement", 2e-3}, {"damping", 0.5}}});
    add(plant, j,
        {"asymmetric_friction", "", {{"level_difference", 0.1}, {"damping_difference", 0.2}}});
    add(plant, j, {"load_dependent_friction", "", {{"load_share", 0.1}}});
    add(plant, j, {"torque_ripple", "", {{"amplitude", 0.05}, {"order", 9.0}, {"phase", 0.4}}});
    add(plant, j, {"gravity", "", {{"amplitude", 0.3}, {"phase", 0.2}}});
  }
  return plant;
}

ForcedMotion swinging() {
  constexpr Index kRows = 2000;
  ForcedMotion forced;
  forced.t_s = VectorXd::LinSpaced(kRows, 0.0, 2.0);
  forced.fresh.assign(kRows, 0);
  for (const double rate : {4.0, 7.0, 2.0}) {
    const Eigen::ArrayXd phase = rate * forced.t_s.array();
    forced.motors.push_back(
        {0.4 * phase.sin(), 0.4 * rate * phase.cos(), -0.4 * rate * rate * phase.sin(), 0.0});
  }
  return forced;
}

/// What the callback adds is what the predictor has, all effects at once.
TEST_F(RobotWriter, BuildsACallbackThatIsThePredictor) {
  const std::string coupled = kMjcf;
  std::ofstream(folder_ / "robot.xml")
      << std::regex_replace(coupled, std::regex("<equality>.*</equality>"), "");
  const Plant plant = with_callback_effects(given());
  const WrittenRobot robot = written(plant);
  std::ofstream(folder_ / "robot_effects.cpp") << robot.callback;
  const std::string command = robot.callback.substr(3, robot.callback.find('\n') - 3);
  const test::Outcome built =
      test::run_command(fmt::format("cd {} && {} 2>&1", folder_.string(), command));
  ASSERT_EQ(built.exit_code, 0) << command << "\n" << built.text;
  void* library = ::dlopen((folder_ / "robot_effects.so").c_str(), RTLD_NOW);
  ASSERT_NE(library, nullptr) << ::dlerror();
  const auto compiled = read_robot_file(folder_ / "out/robot.xml");
  ASSERT_TRUE(compiled.ok()) << compiled.error().message;
  mjModel* model = compiled->model.get();
  const auto install =
      reinterpret_cast<int (*)(mjModel*)>(::dlsym(library, "ravencal_effects_install"));
  ASSERT_NE(install, nullptr);
  ASSERT_EQ(install(model), 0);

  const ForcedMotion forced = swinging();
  const auto predicted = predict(plant, forced);
  ASSERT_TRUE(predicted.ok());
  mjData* data = mj_makeData(model);
  for (Index i = 0; i < forced.t_s.size(); ++i) {
    data->time = forced.t_s[i];
    for (Index j = 0; j < 3; ++j) {
      const Motion& motion = forced.motors[static_cast<std::size_t>(j)];
      data->qpos[j] = motion.q[i];
      data->qvel[j] = motion.v[i];
      data->qacc[j] = motion.a[i];
    }
    mj_inverse(model, data);
    for (std::size_t j : {0U, 1U})
      ASSERT_NEAR(data->qfrc_inverse[j], predicted->effort[j][i], 1e-6) << i << " joint " << j;
  }
  mjcb_passive = nullptr;
  mj_deleteData(data);
  ::dlclose(library);
}

}  // namespace
}  // namespace ravencal::physics
