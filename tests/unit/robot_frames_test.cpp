// SPDX-License-Identifier: Apache-2.0
//
// Frames, replicas, attached models and classes of MJCF: the same robot written with and without
// them, the poses composed by hand.
#include <Eigen/Geometry>

#include "robot_texts.hpp"

namespace ravencal::physics {
namespace {

class RobotFrames : public RobotTexts {};

TEST_F(RobotFrames, FramesPutBodiesWhereTheyStand) {
  const Plant with = plant_of(fmt::format(R"(<mujoco><default><default class="y"><joint axis="0 1 0"
      damping="0.5"/></default></default><worldbody>
    <frame pos="1 0 0.2" euler="0 0 90" childclass="y"><frame pos="0 0.5 0">
      <body name="a" pos="0 0.5 0"><joint name="j"/>{0}
        <frame quat="0 1 0 0" pos="0 0 -0.3"><geom fromto="0 0 0 0.4 0 0" size="0.02" density="500"/>
          <body name="b" pos="0.4 0 0"><joint name="k" axis="0 0 1"/>{0}</body></frame>
      </body></frame></frame></worldbody></mujoco>)",
                                          kLink));
  const Plant without = plant_of(fmt::format(R"(<mujoco><worldbody>
      <body name="a" pos="0 0 0.2" quat="0.70710678118654752 0 0 0.70710678118654752">
        <joint name="j" axis="0 1 0" damping="0.5"/>{0}
        <body name="b" pos="0.4 0 -0.3" quat="0 1 0 0"><joint name="k" axis="0 0 1"/>{0}</body>
      </body></worldbody></mujoco>)",
                                             kLink));
  expect_same_robot(with, without);
  EXPECT_EQ(with.joints[0].parameter("viscous_friction", "damping"), 0.5);
  EXPECT_EQ(with.joints[1].parameter("viscous_friction", "damping"), 0.5);
}

TEST_F(RobotFrames, FramesTurnTheJointsInThem) {
  const Plant with = plant_of(fmt::format(
      R"(<mujoco><compiler angle="radian" eulerseq="zyx"/><worldbody><body name="a">
      <frame pos="0 0.2 0" euler="0 1.5707963267948966 0"><joint name="j" pos="0 0 0.1"/></frame>{}
      </body></worldbody></mujoco>)",
      kLink));
  const Plant without = plant_of(fmt::format(
      R"(<mujoco><worldbody><body name="a"><joint name="j" pos="0.1 0.2 0" axis="1 0 0"/>{}
      </body></worldbody></mujoco>)",
      kLink));
  expect_same_robot(with, without);
}

/// Each step is in the frame of the copy before it, and what drives the joint is there as often.
TEST_F(RobotFrames, ReplicasStandBehindEachOther) {
  const Plant with = plant_of(fmt::format(R"(<mujoco><worldbody>
    <replicate count="3" sep="_" offset="1 0 0" euler="0 0 90">
      <body name="a" pos="0 0.1 0"><joint name="j" axis="1 0 0"/>{}</body></replicate>
    </worldbody><actuator><position name="p" joint="j" kp="7"/></actuator></mujoco>)",
                                          kLink));
  const auto body = [](const char* name, const char* pos, const char* quat) {
    return fmt::format(R"(<body pos="{}" quat="{}"><joint name="{}" axis="1 0 0"/>{}</body>)", pos,
                       quat, name, kLink);
  };
  const Plant without = plant_of(fmt::format(
      "<mujoco><worldbody>{}{}{}</worldbody></mujoco>", body("j_0", "0 0.1 0", "1 0 0 0"),
      body("j_1", "0.9 0 0", "0.70710678118654752 0 0 0.70710678118654752"),
      body("j_2", "1 0.9 0", "0 0 0 1")));
  expect_same_robot(with, without);
  for (const Joint& joint : with.joints) {
    ASSERT_TRUE(joint.controller) << joint.name;
    EXPECT_EQ(joint.controller->kp_n_m_per_rad, 7.0);
  }
}

/// Angles of several axes add up each, and do not chain.
TEST_F(RobotFrames, ReplicasTurnByMultiplesOfTheirAngles) {
  const Plant with = plant_of(fmt::format(R"(<mujoco><worldbody>
    <replicate count="3" offset="0.2 0.1 0" euler="30 40 20"><body pos="0.5 0 0">
      <joint name="j" axis="0 1 0"/>{}</body></replicate></worldbody></mujoco>)",
                                          kLink));
  const auto copy = [](const char* name, const char* pos, const char* euler) {
    return fmt::format(
        R"(<body pos="{}" euler="{}"><body pos="0.5 0 0"><joint name="{}" axis="0 1 0"/>{}
      </body></body>)",
        pos, euler, name, kLink);
  };
  // The second step is turned by 30, 40, 20 degrees about x, y, z of the turned frame.
  const Eigen::Vector3d second = Eigen::Vector3d(0.2, 0.1, 0.0) +
                                 Eigen::AngleAxisd(M_PI / 6.0, Eigen::Vector3d::UnitX()) *
                                     (Eigen::AngleAxisd(M_PI / 4.5, Eigen::Vector3d::UnitY()) *
                                      (Eigen::AngleAxisd(M_PI / 9.0, Eigen::Vector3d::UnitZ()) *
                                       Eigen::Vector3d(0.2, 0.1, 0.0)));
  const std::string at = fmt::format("{} {} {}", second[0], second[1], second[2]);
  const Plant without = plant_of(
      fmt::format("<mujoco><worldbody>{}{}{}</worldbody></mujoco>", copy("j0", "0 0 0", "0 0 0"),
                  copy("j1", "0.2 0.1 0", "30 40 20"), copy("j2", at.c_str(), "60 80 40")));
  expect_same_robot(with, without);
}

/// The library takes the last word of several sections.
TEST_F(RobotFrames, ClassesStandInSeveralSections) {
  const Plant plant = plant_of(fmt::format(R"(<mujoco><default><joint damping="1"/></default>
    <default><position kp="50" kv="7"/><joint actuatorfrcrange="-3 3"/></default>
    <worldbody><body><joint name="j"/>{}</body></worldbody>
    <actuator><position joint="j"/></actuator></mujoco>)",
                                           kLink));
  ASSERT_EQ(plant.joints.size(), 1U);
  ASSERT_TRUE(plant.joints[0].controller);
  EXPECT_EQ(plant.joints[0].controller->kd_n_m_s_per_rad, 7.0);
  EXPECT_EQ(plant.joints[0].parameter("saturation", "limit"), 3.0);
}

TEST_F(RobotFrames, WhatWouldBeAnotherRobotIsRefused) {
  const auto arm = [](const std::string& more, const std::string& joint = "<joint name=\"j\"/>") {
    return fmt::format("<mujoco><worldbody><body>\n{}{}</body></worldbody>{}</mujoco>", joint,
                       kLink, more);
  };
  const std::pair<std::string, const char*> bad[] = {
      {arm("\n<actuator><dcmotor joint=\"j\"/></actuator>"), "robot.xml:3: <dcmotor>"},
      {arm("", "<joint name=\"planar\" type=\"planar\"/>"),
       "robot.xml:2: type 'planar' of <joint>"},
      {arm("", "<joint name=\"j\"/><flexcomp/>"), "robot.xml:2: <flexcomp>"},
      {arm("") + "\n<mujoco/>", "robot.xml:3: <mujoco> stands beside"},
      {"<mujoco><default><geom euler=\"0 70 0\"/></default><worldbody><body>\n<joint name=\"j\"/>"
       "<frame pos=\"0 0 1\"><geom type=\"box\" size=\"1 2 "
       "3\"/></frame></body></worldbody></mujoco>",
       "robot.xml:2: the class of this <geom>"},
      {"<mujoco><compiler eulerseq=\"abc\"/><worldbody>\n<frame euler=\"1 2 3\"><body>"
       "<joint name=\"j\"/></body></frame></worldbody></mujoco>",
       "robot.xml:2: eulerseq is 'abc'"},
  };
  for (const auto& [text, words] : bad)
    EXPECT_NE(refusal_of(text).find(words), std::string::npos) << text << "\n" << refusal_of(text);
}

TEST_F(RobotFrames, NumbersOfReplicasHaveAsManyDigitsAsTheirCount) {
  const Plant plant = plant_of(fmt::format(
      R"(<mujoco><worldbody><body name="a"><joint name="j"/>{0}<replicate count="2" offset="0 0 1">
      <replicate count="10" offset="1 0 0"><body><joint name="k"/>{0}</body></replicate>
      </replicate></body></worldbody></mujoco>)",
      kLink));
  ASSERT_EQ(plant.joints.size(), 21U);
  EXPECT_EQ(plant.joints[1].name, "k000");
  EXPECT_EQ(plant.joints[20].name, "k091");
}

/// A body and a whole world of another file, with its classes and what drives it.
TEST_F(RobotFrames, AttachedModelsStandWhereTheyAreAttached) {
  (void)write("hand.xml",
              fmt::format(R"(<mujoco><default><joint axis="0 1 0"/><default class="soft">
      <joint damping="0.2"/><position kp="5"/></default></default>
    <worldbody><body name="palm" pos="0 0 0.3"><joint name="wrist"/>{0}
      <body name="finger" pos="0.2 0 0"><joint name="curl" class="soft"/>{0}</body></body></worldbody>
    <equality><joint joint1="curl" joint2="wrist" polycoef="0 0.5 0 0 0"/></equality>
    <actuator><position name="pull" joint="curl" class="soft"/></actuator></mujoco>)",
                          kLink));
  const Plant with =
      plant_of(fmt::format(R"(<mujoco><asset><model name="hand" file="hand.xml"/></asset>
    <worldbody><body name="arm"><joint name="j"/>{0}
      <frame pos="1 0 0"><attach model="hand" body="palm" prefix="l_"/></frame></body>
      <frame pos="0 2 0"><attach model="hand" prefix="r_"/></frame></worldbody></mujoco>)",
                           kLink));
  const auto hand = [](const char* prefix, const char* pos) {
    return fmt::format(R"(<body pos="{1}"><joint name="{2}wrist" axis="0 1 0"/>{0}
      <body pos="0.2 0 0"><joint name="{2}curl" axis="0 1 0" damping="0.2"/>{0}</body></body>)",
                       kLink, pos, prefix);
  };
  const Plant without = plant_of(
      fmt::format("<mujoco><worldbody><body><joint name=\"j\"/>{}{}</body>{}</worldbody></mujoco>",
                  kLink, hand("l_", "1 0 0.3"), hand("r_", "0 2 0.3")));
  expect_same_robot(with, without);
  ASSERT_EQ(with.joints.size(), 5U);
  for (const std::size_t curl : {2U, 4U}) {
    EXPECT_EQ(with.joints[curl].parameter("viscous_friction", "damping"), 0.2) << curl;
    ASSERT_TRUE(with.joints[curl].controller) << curl;
    EXPECT_EQ(with.joints[curl].controller->kp_n_m_per_rad, 5.0);
    EXPECT_EQ(with.coupling[curl][curl - 1], 0.5);
  }
}

/// An attached model has its own classes, also where it has none, and the meshes that weigh.
TEST_F(RobotFrames, AttachedModelsTakeNothingFromTheOneAroundThem) {
  (void)write("plain.xml",
              fmt::format("<mujoco><worldbody><body name=\"a\"><joint name=\"j\"/>{}</body>"
                          "</worldbody></mujoco>",
                          kLink));
  const Plant plant =
      plant_of(fmt::format(R"(<mujoco><asset><model name="m" file="plain.xml"/></asset>
    <default><default class="c"><joint axis="1 0 0" damping="5"/></default></default>
    <worldbody><body childclass="c"><joint name="base"/>{}
      <attach model="m" body="a" prefix="p_"/></body></worldbody></mujoco>)",
                           kLink));
  ASSERT_EQ(plant.joints.size(), 2U);
  EXPECT_EQ(plant.joints[0].parameter("viscous_friction", "damping"), 5.0);
  EXPECT_EQ(plant.joints[1].parameter("viscous_friction", "damping"), 0.0);
  (void)write("other.xml",
              fmt::format("<mujoco><default><joint axis=\"0 1 0\"/></default><worldbody>"
                          "<body name=\"b\"><joint name=\"k\"/>{}</body></worldbody></mujoco>",
                          kLink));
  const std::string twice = refusal_of(
      "<mujoco><asset><model name=\"m\" file=\"plain.xml\"/><model name=\"o\" file=\"other.xml\"/>"
      "</asset><worldbody>\n<attach model=\"m\" body=\"a\" prefix=\"p_\"/>\n"
      "<attach model=\"o\" body=\"b\" prefix=\"p_\"/></worldbody></mujoco>");
  EXPECT_NE(twice.find("robot.xml:3: <attach> of another model"), std::string::npos) << twice;
}

TEST_F(RobotFrames, AttachmentsThatCannotBeFollowedAreRefusedWithTheirPlace) {
  (void)write("self.xml",
              "<mujoco><asset><model name=\"s\" file=\"self.xml\"/></asset><worldbody>"
              "<body name=\"b\"><attach model=\"s\" body=\"b\" prefix=\"x\"/></body>"
              "</worldbody></mujoco>");
  (void)write("rad.xml",
              "<mujoco><compiler angle=\"radian\"/><worldbody><body name=\"b\"/>"
              "</worldbody></mujoco>");
  const auto attach = [](const char* file, const char* body, const char* defaults = "") {
    return fmt::format(
        "<mujoco>{}<asset><model name=\"m\" file=\"{}\"/></asset>\n<worldbody>\n"
        "<attach model=\"m\" body=\"{}\" prefix=\"p\"/></worldbody></mujoco>",
        defaults, file, body);
  };
  const std::pair<std::string, const char*> bad[] = {
      {attach("self.xml", "b"), "models are attached"},
      {attach("rad.xml", "b"), "another angle"},
      {attach("none.xml", "b"), "none.xml"},
      {attach("rad.xml", "none", "<compiler angle=\"radian\"/>"), "robot.xml:3: <attach>"},
      {attach("rad.xml", "b",
              "<compiler angle=\"radian\"/><default><joint damping=\"1\"/></default>"),
       "put them into a class"},
      {"<mujoco>\n<worldbody><attach model=\"m\" prefix=\"p\"/></worldbody></mujoco>",
       "no <model> among the assets"},
  };
  for (const auto& [text, words] : bad)
    EXPECT_NE(refusal_of(text).find(words), std::string::npos) << text << "\n" << refusal_of(text);
}

TEST_F(RobotFrames, NothingThatIsPartOfTheRobotIsDropped) {
  const std::string unknown = refusal_of(fmt::format(
      "<mujoco><worldbody><body><joint name=\"j\"/>{0}\n<wormhole>\n<body><joint name=\"k\"/>{0}"
      "</body></wormhole></body></worldbody></mujoco>",
      kLink));
  EXPECT_NE(unknown.find("robot.xml:2: <wormhole>"), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("holds <body>"), std::string::npos) << unknown;
  const std::string placed = refusal_of(
      "<mujoco><worldbody><body>\n<frame><inertial pos=\"0 0 0\" mass=\"1\"/></frame></body>"
      "</worldbody></mujoco>");
  EXPECT_NE(placed.find("robot.xml:2: <inertial>"), std::string::npos) << placed;
  for (const char* count : {"", "count=\"0\"", "count=\"-3\"", "count=\"1000000\""})
    EXPECT_NE(refusal_of(fmt::format("<mujoco><worldbody><replicate {}><body><joint/>{}</body>"
                                     "</replicate></worldbody></mujoco>",
                                     count, kLink))
                  .find("<replicate>"),
              std::string::npos)
        << count;
}

}  // namespace
}  // namespace ravencal::physics
