// SPDX-License-Identifier: Apache-2.0
//
// Words of robot models that the installed libmujoco does not know: the same robot written with and
// without them, the poses composed by hand.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "physics/drives.hpp"
#include "physics/plant.hpp"
#include "physics/rigid_bodies.hpp"
#include "physics/robot_model/robot_file.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;

class RobotWords : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  [[nodiscard]] Plant plant_of(const std::string& text, const std::string& name = "robot.xml") {
    auto plant = load_plant(write(name, text));
    EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
    return plant.ok() ? std::move(plant).value() : Plant{};
  }
  [[nodiscard]] std::string refusal_of(const std::string& text,
                                       const std::string& name = "robot.xml") const {
    const auto plant = load_plant(write(name, text));
    return plant.ok() ? "none" : plant.error().message;
  }

  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("robot_words_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

std::string notes_of(const Plant& plant) { return fmt::format("{}", fmt::join(plant.notes, "\n")); }

std::vector<std::string> names_of(const Plant& plant) {
  std::vector<std::string> out;
  for (const Joint& joint : plant.joints) out.push_back(joint.name);
  return out;
}

using Names = std::vector<std::string>;

/// Efforts at several states: two plants with the same ones are one robot.
std::vector<VectorXd> efforts_of(const Plant& plant) {
  auto bodies = RigidBodies::create(plant);
  EXPECT_TRUE(bodies.ok()) << (bodies.ok() ? "" : bodies.error().message);
  std::vector<VectorXd> out;
  const auto count = static_cast<Eigen::Index>(plant.joints.size());
  for (int k = 0; bodies.ok() && k < 5; ++k) {
    const VectorXd q = VectorXd::LinSpaced(count, 0.4 * k, 1.0 - 0.3 * k);
    out.push_back(bodies->efforts(q, 0.7 * q.array().cos(), 2.0 * q.array().sin()));
  }
  return out;
}

void expect_same_robot(const Plant& one, const Plant& other) {
  EXPECT_EQ(names_of(one), names_of(other));
  const std::vector<VectorXd> a = efforts_of(one), b = efforts_of(other);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k].size(), b[k].size());
    EXPECT_GT(a[k].norm(), 1e-3);
    EXPECT_LT((a[k] - b[k]).norm(), 1e-9 * (1.0 + a[k].norm())) << k;
  }
}

constexpr const char* kLink =
    "<inertial pos=\"0.1 0.02 0\" mass=\"1.5\" diaginertia=\"0.02 0.03 0.04\"/>";

TEST_F(RobotWords, FramesPutBodiesWhereTheyStand) {
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

TEST_F(RobotWords, FramesTurnTheJointsInThem) {
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
TEST_F(RobotWords, ReplicasStandBehindEachOther) {
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
TEST_F(RobotWords, ReplicasTurnByMultiplesOfTheirAngles) {
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
TEST_F(RobotWords, ClassesStandInSeveralSections) {
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

TEST_F(RobotWords, WhatWouldBeAnotherRobotIsRefused) {
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

TEST_F(RobotWords, NumbersOfReplicasHaveAsManyDigitsAsTheirCount) {
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
TEST_F(RobotWords, AttachedModelsStandWhereTheyAreAttached) {
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
TEST_F(RobotWords, AttachedModelsTakeNothingFromTheOneAroundThem) {
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

TEST_F(RobotWords, AttachmentsThatCannotBeFollowedAreRefusedWithTheirPlace) {
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

TEST_F(RobotWords, NothingThatIsPartOfTheRobotIsDropped) {
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
  EXPECT_NE(notes_of(plant).find("speeds of 1 joint"), std::string::npos) << notes_of(plant);
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
