// SPDX-License-Identifier: Apache-2.0
//
// Words of robot models that the installed libmujoco does not know or does not ask for.
#include <sys/stat.h>

#include "physics/drives.hpp"
#include "physics/servo_law.hpp"
#include "robot_texts.hpp"

namespace ravencal::physics {
namespace {

class RobotWords : public RobotTexts {};

TEST_F(RobotWords, DampingOfServosIsTaken) {
  const Plant plant = plant_of(fmt::format(R"(<mujoco><default><default class="servo">
      <position kp="50" kv="3" inheritrange="1"/></default></default><worldbody>
      <body><joint name="a" axis="0 1 0"/>{0}</body><body><joint name="b" axis="0 0 1" armature="0.1"/>{0}</body>
      <body><joint name="c"/>{0}</body></worldbody>
    <actuator><position joint="a" class="servo"/><position joint="b" kp="40" dampratio="1" gear="2"/>
      <position name="lag" joint="c" kp="9" kv="2" timeconst="0.05"/></actuator></mujoco>)",
                                           kLink));
  ASSERT_EQ(plant.joints.size(), 3U);
  for (const Joint& joint : plant.joints) ASSERT_TRUE(joint.controller) << joint.name;
  EXPECT_EQ(plant.joints[0].controller->kp_n_m_per_rad, 50.0);
  EXPECT_EQ(plant.joints[0].controller->kd_n_m_s_per_rad, 3.0);
  // The joint turns 0.04 about its mass and 1.5 kg at 0.1 m and 0.02 m from its axis, and 0.1.
  const double inertia = 0.04 + 1.5 * (0.01 + 0.0004) + 0.1;
  EXPECT_NEAR(plant.joints[1].controller->kd_n_m_s_per_rad,
              4.0 * 2.0 * std::sqrt(40.0 * inertia) / 2.0, 1e-9);
  EXPECT_EQ(plant.joints[2].controller->kd_n_m_s_per_rad, 2.0);
  EXPECT_NE(notes_of(plant).find("timeconst of actuator lag"), std::string::npos)
      << notes_of(plant);
}

TEST_F(RobotWords, LimitsOfEffortsAreTakenAndWhatIsNotIsSaid) {
  const Plant plant = plant_of(fmt::format(R"(<mujoco><worldbody>
      <body><joint name="a" actuatorfrcrange="-4 4"/>{0}</body>
      <body><joint name="b" actuatorfrcrange="-3 5"/>{0}</body>
      <body><joint name="c"/>{0}</body></worldbody>
    <actuator><motor joint="a" forcelimited="true" forcerange="-9 9"/>
      <motor name="odd" joint="c" forcelimited="true" forcerange="-1 2"/>
      <general name="slow" joint="b" dyntype="filter" dynprm="0.1"/></actuator></mujoco>)",
                                           kLink));
  ASSERT_EQ(plant.joints.size(), 3U);
  EXPECT_EQ(plant.joints[0].parameter("saturation", "limit"), 4.0);
  EXPECT_EQ(plant.joints[1].parameter("saturation", "limit"), 5.0);
  EXPECT_EQ(plant.joints[2].parameter("saturation", "limit"), 2.0);
  for (const char* said : {"actuatorfrcrange -3 5 of joint b", "forcerange -1 2 of actuator odd",
                           "dyntype of actuator slow"})
    EXPECT_NE(notes_of(plant).find(said), std::string::npos) << said << "\n" << notes_of(plant);
}

TEST_F(RobotWords, AFloatingBaseIsHeld) {
  for (const char* free : {"<freejoint name=\"f\"/>", "<joint type=\"free\"/>"}) {
    const auto model = [&](const char* base) {
      return fmt::format(
          "<mujoco><worldbody><body name=\"trunk\" pos=\"0 0 1\">{}{}<body><joint name=\"j\" "
          "axis=\"0 1 0\"/>{}</body></body></worldbody></mujoco>",
          base, kLink, kLink);
    };
    const Plant floating = plant_of(model(free));
    expect_same_robot(floating, plant_of(model("")));
    EXPECT_NE(notes_of(floating).find("body trunk floats"), std::string::npos)
        << notes_of(floating);
  }
}

TEST_F(RobotWords, ASceneIsItsRobot) {
  (void)write("arm.xml",
              fmt::format("<mujoco><worldbody><body><joint name=\"j\"/>{}</body></worldbody>"
                          "</mujoco>",
                          kLink));
  const Plant scene = plant_of(R"(<mujoco><include file="arm.xml"/>
    <asset><texture name="t" type="2d" builtin="checker" width="9" height="9"/>
      <material name="floor" texture="t"/><mesh name="cover" file="nowhere.stl"/></asset>
    <default><default class="look"><geom type="mesh" mesh="cover" material="floor"/></default></default>
    <worldbody><geom type="plane" size="0 0 0.05" material="floor"/><site name="s" material="floor"/>
      <geom class="look"/>
      <body name="table"><geom type="box" size="1 1 1" material="floor"/></body></worldbody></mujoco>)");
  EXPECT_EQ(names_of(scene), Names{"j"});
}

/// The library sees a text that was put together and repaired.
TEST_F(RobotWords, ErrorsNameTheLineOfTheFileInWhichTheyStand) {
  (void)write("arm.xml",
              "<mujoco>\n<worldbody>\n<body>\n<joint axis=\"x\"/>\n</body></worldbody></mujoco>");
  const std::string included = refusal_of("<mujoco>\n\n<include file=\"arm.xml\"/></mujoco>");
  EXPECT_NE(included.find("arm.xml:4: MuJoCo"), std::string::npos) << included;
  EXPECT_EQ(included.find("line"), std::string::npos) << included;
  const std::string compiled = refusal_of(
      "<mujoco>\n<worldbody>\n<body>\n<joint name=\"j\"/>\n</body></worldbody></mujoco>");
  EXPECT_NE(compiled.find("robot.xml:3: MuJoCo"), std::string::npos) << compiled;
}

TEST_F(RobotWords, DepthOfNestingEnds) {
  const auto chain = [](const std::string& next) {
    std::string out = "<mujocoinclude>";
    for (int k = 0; k < 90; ++k) out += "<body>";
    out += "<include file=\"" + next + "\"/>";
    for (int k = 0; k < 90; ++k) out += "</body>";
    return out + "</mujocoinclude>";
  };
  for (int k = 0; k < 20; ++k)
    (void)write(fmt::format("deep{}", k), chain(fmt::format("deep{}", k + 1)));
  const std::string refused =
      refusal_of("<mujoco><worldbody><include file=\"deep0\"/></worldbody></mujoco>");
  EXPECT_NE(refused.find("nested deeper than"), std::string::npos) << refused;
}

TEST_F(RobotWords, SmallFilesCannotAskForEndlessWork) {
  const std::string many = refusal_of(
      "<mujoco><worldbody><body><composite type=\"grid\" count=\"3000 3000 1\" spacing=\"0.1\">"
      "<geom size=\"0.01\"/></composite></body></worldbody></mujoco>");
  EXPECT_NE(many.find("cannot be read"), std::string::npos) << many;
  const std::filesystem::path beside = write("beside.xml", "");
  ASSERT_EQ(::mkfifo((beside.parent_path() / "pipe.xml").c_str(), 0600), 0);
  const std::string waits = refusal_of("<mujoco><include file=\"pipe.xml\"/></mujoco>");
  EXPECT_NE(waits.find("pipe.xml"), std::string::npos) << waits;
}

constexpr const char* kUrdfArm = R"(<robot name="r"><link name="base"/>
  <link name="a"><inertial><origin xyz="0.2 0 0" rpy="0 0 0.3"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.02" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="flange"/>
  <link name="b"><inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="c"><inertial><mass value="0.1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="5" velocity="2"/><dynamics damping="{damping}"/></joint>
  <joint name="fixed" type="fixed"><parent link="a"/><child link="flange"/><origin xyz="0.4 0 0"/></joint>
  <joint name="k" type="continuous"><parent link="flange"/><child link="b"/><axis xyz="0 0 1"/></joint>
  <joint name="l" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
    <mimic joint="j" multiplier="-0.5"/></joint>
  <transmission name="t"><joint name="k"/><actuator name="m"><mechanicalReduction>50</mechanicalReduction>
    </actuator></transmission>{more}</robot>)";

std::string urdf(double izz, double damping = 0.3, const char* more = "") {
  return fmt::format(fmt::runtime(kUrdfArm), fmt::arg("izz", izz), fmt::arg("damping", damping),
                     fmt::arg("more", more));
}

TEST_F(RobotWords, UrdfGivesLimitsMimicsAndReductions) {
  const Plant plant = plant_of(urdf(0.025), "robot.urdf");
  EXPECT_EQ(names_of(plant), (Names{"j", "k", "l"}));
  EXPECT_EQ(plant.joints[0].parameter("saturation", "limit"), 5.0);
  EXPECT_EQ(plant.joints[1].reduction, 50.0);
  EXPECT_EQ(plant.coupling[2][0], -0.5);
  EXPECT_EQ(plant.joints[0].limits, (Limits{-1.0, 1.0, 2.0}));
  EXPECT_EQ(plant.joints[1].limits, Limits{});
}

TEST_F(RobotWords, RangesAreLimitsUnlessNoRobotIsThatLarge) {
  const auto limits_of = [&](const char* range) {
    return plant_of(fmt::format("<mujoco><compiler angle=\"radian\"/><worldbody><body>"
                                "<joint name=\"j\" {}/>{}</body></worldbody></mujoco>",
                                range, kLink))
        .joints[0]
        .limits;
  };
  EXPECT_EQ(limits_of("limited=\"true\" range=\"-0.5 0.75\""), (Limits{-0.5, 0.75, {}}));
  EXPECT_EQ(limits_of("limited=\"true\" range=\"-0.5 1e16\""), (Limits{-0.5, {}, {}}));
  EXPECT_EQ(limits_of("limited=\"false\" range=\"-0.5 0.75\""), Limits{});
}

/// The joint feels the same of its motor, whose turns are counted now.
TEST_F(RobotWords, AReductionIsTheMotorsAlone) {
  Plant plant = plant_of(fmt::format(
      R"(<mujoco><worldbody><body><joint name="j" armature="0.4"/>{}</body></worldbody>
      <actuator><position joint="j" kp="20" kv="2"/></actuator></mujoco>)",
      kLink));
  ASSERT_EQ(plant.joints.size(), 1U);
  Joint& joint = plant.joints[0];
  const auto before = servo_law(joint);
  set_reduction(joint, 100.0);
  const auto after = servo_law(joint);
  ASSERT_TRUE(before && after);
  EXPECT_NEAR(after->position, before->position, 1e-12);
  EXPECT_NEAR(after->rate, before->rate, 1e-12);
  EXPECT_NEAR(joint.motor_inertia_kg_m2 * joint.reduction * joint.reduction, 0.4, 1e-12);
  EXPECT_EQ(joint.reduction / joint.gearbox_ratio, 1.0) << "efforts are the joint's";
}

/// About a vertical axis the effort for an acceleration is the inertia about it, by Steiner.
TEST_F(RobotWords, UrdfInertiasAreThoseOfTheFile) {
  for (const double izz : {0.025, 0.3}) {  // 0.3: more than 0.01 + 0.02, which no body has
    const Plant plant = plant_of(urdf(izz), "robot.urdf");
    ASSERT_EQ(plant.joints.size(), 3U);
    auto bodies = RigidBodies::create(plant);
    ASSERT_TRUE(bodies.ok());
    const VectorXd zero = VectorXd::Zero(3);
    const double effort = bodies->efforts(zero, zero, VectorXd::Unit(3, 0))[0];
    const double wanted = izz + 2.0 * 0.04 + 0.01 + 0.5 * 0.16 + 0.01 + 0.1 * 0.16;
    EXPECT_NEAR(effort, wanted, 1e-9) << izz;
    EXPECT_EQ(notes_of(plant).find("inertia of a:") != std::string::npos, izz > 0.03)
        << notes_of(plant);
  }
}

TEST_F(RobotWords, UrdfThatIsNotWholeIsRefusedWithItsPlace) {
  const std::pair<std::string, const char*> bad[] = {
      {urdf(0.025, -0.3), "damping of joint 'j' is -0.3"},
      {urdf(0.025, 0.3, "\n<link name=\"second\"/>"), "link 'second' hangs on no joint"},
      {urdf(0.025, 0.3,
            "<link name=\"d\"><inertial><mass value=\"-1\"/></inertial></link><joint name=\"m\" "
            "type=\"fixed\"><parent link=\"a\"/><child link=\"d\"/></joint>"),
       "value of link 'd' is -1"},
      {urdf(0.025, 0.3,
            "<link name=\"d\"/><joint name=\"m\" type=\"screw\"><parent link=\"a\"/>"
            "<child link=\"d\"/></joint>"),
       "joint 'm' is of type 'screw'"},
      {urdf(
           0.025, 0.3,
           "<group><joint name=\"m\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>"
           "</group>"),
       "<joint> stands in <group>"},
      {urdf(0.025, 0.3, "\n<link name=\"$(arg side)_hand\"/>"), "xacro that nobody expanded"},
      {urdf(0.025, 0.3, "\n<xacro:property name=\"x\" value=\"1\"/>"),
       "xacro that nobody expanded"},
  };
  for (const auto& [text, words] : bad) {
    const std::string refused = refusal_of(text, "robot.urdf");
    EXPECT_NE(refused.find(words), std::string::npos) << refused;
    EXPECT_NE(refused.find("robot.urdf:"), std::string::npos) << refused;
  }
  EXPECT_NE(refusal_of("<robot/>", "robot.urdf.xacro").find("`xacro robot.urdf.xacro"),
            std::string::npos);
}

}  // namespace
}  // namespace ravencal::physics
