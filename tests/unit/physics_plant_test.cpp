// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "physics/effects/effect_spec.hpp"
#include "physics/plant.hpp"
#include "physics/plant_effort.hpp"
#include "physics/plant_writer.hpp"

namespace ravencal::physics {
namespace {

const std::string kPlantPath = std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml";

std::string shipped_text() {
  std::ifstream file(kPlantPath);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The shipped plant with one text replaced; fails the test if the text is not there.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = shipped_text();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

std::string error_of(const std::string& text) {
  const auto plant = parse_plant(text, "p.toml");
  EXPECT_FALSE(plant.ok());
  return plant.ok() ? "" : plant.error().message;
}

std::size_t line_of(const std::string& text, const std::string& needle) {
  return 1 +
         static_cast<std::size_t>(std::count(
             text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find(needle)), '\n'));
}

/// The text with the number of line `line` (from 1) replaced, or "" if no line of `KEY = NUMBER`.
std::string with_number(const std::string& text, std::size_t line, const std::string& number,
                        std::string& key) {
  static const std::regex kNumber(R"(^(\s*)(\w+) = (\[?)(-?[0-9][-+.eE0-9]*)(.*)$)");
  std::istringstream lines(text);
  std::string changed_text, one;
  bool found = false;
  for (std::size_t at = 1; std::getline(lines, one); ++at) {
    std::smatch parts;
    if (at == line && std::regex_match(one, parts, kNumber)) {
      key = parts[2];
      one = parts[1].str() + key + " = " + parts[3].str() + number + parts[5].str();
      found = true;
    }
    changed_text += one + "\n";
  }
  return found ? changed_text : "";
}

TEST(Plant, HasARangeForEveryNumber) {
  const std::string text = shipped_text();
  const auto lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  int numbers = 0;
  for (std::size_t line = 1; line <= lines; ++line) {
    std::string key;
    for (const char* number : {"1e300", "-1e300", "inf", "nan"}) {
      const std::string odd = with_number(text, line, number, key);
      if (odd.empty()) continue;
      ++numbers;
      const std::string error = error_of(odd);
      EXPECT_NE(error.find("p.toml:" + std::to_string(line) + ":"), std::string::npos)
          << key << " = " << number << ": " << error;
      EXPECT_NE(error.find(key), std::string::npos) << error;
      if (number[0] == 'i' || number[0] == 'n') continue;
      EXPECT_NE(error.find(number[0] == '-' ? "-1e+300" : "1e+300"), std::string::npos) << error;
      EXPECT_NE(error.find("must be from"), std::string::npos) << error;
    }
  }
  EXPECT_GT(numbers, 400);
}

TEST(Plant, RefusesSizesBelowZeroAndPeriodsWithoutEnd) {
  const std::string text = shipped_text();
  const auto lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  const std::regex size(
      "rate_hz|.*_rate_hz|truth_.*|mass_kg|.*stiffness.*|.*damping.*|.*width.*|"
      "yield.*|time_s|.*_time_s|level.*|motor_inertia.*|gearbox_ratio|reduction.*|"
      "joint_encoder_resolution.*|displacement.*|presliding.*|kp_.*|kd_.*|"
      "dac_limit_counts|motor_encoder_counts_per_rev|inertia_kg_m2");
  std::set<std::string> refused;
  for (std::size_t line = 1; line <= lines; ++line) {
    std::string key;
    const std::string odd = with_number(text, line, "-1", key);
    if (odd.empty() || !std::regex_match(key, size)) continue;
    EXPECT_NE(error_of(odd).find(key + " is -1, must be from"), std::string::npos) << key;
    refused.insert(key);
  }
  EXPECT_GT(refused.size(), 25U);
  std::set<std::string> of_time;
  for (std::size_t line = 1; line <= lines; ++line) {
    std::string key;
    const std::string odd = with_number(text, line, "0", key);
    if (odd.empty() || !std::regex_match(key, std::regex(".*rate_hz|truth_period_s"))) continue;
    EXPECT_NE(error_of(odd).find(key + " is 0, must be from"), std::string::npos) << key;
    of_time.insert(key);
  }
  EXPECT_EQ(of_time, (std::set<std::string>{"control_rate_hz", "inner_rate_hz", "rate_hz",
                                            "truth_period_s"}));
}

TEST(Plant, ReadsTheShippedRobotWithThePublishedConstants) {
  const auto plant = load_plant(kPlantPath);
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  ASSERT_EQ(plant->joints.size(), 3U);
  EXPECT_EQ(plant->joints[0].name, "shoulder");
  EXPECT_EQ(plant->joints[2].kind, JointKind::kPrismatic);
  EXPECT_DOUBLE_EQ(plant->joints[1].reduction, 121.522074965);
  EXPECT_DOUBLE_EQ(plant->coupling[1][0], -0.14545);
  EXPECT_DOUBLE_EQ(plant->joints[2].controller->kd_n_m_s_per_rad, 0.012);
  EXPECT_DOUBLE_EQ(plant->joints[0].homing->dac_threshold_counts, 2100);
  EXPECT_GT(plant->joints[1].parameter("compliance", "stiffness"), 0.0);
  EXPECT_EQ(plant->joints[1].find_effect("coupling")->from, "shoulder");
  EXPECT_NE(plant->hash, 0U);
}

TEST(Plant, NamesFileLineAndKnownKeysOfAnUnknownKey) {
  const std::string text = changed("mass_kg = 0.494", "mas_kg = 0.494");
  const std::string error = error_of(text);
  EXPECT_NE(error.find("p.toml:"), std::string::npos) << error;
  EXPECT_NE(error.find("mass_kg"), std::string::npos) << error;
  const std::string extra = changed("name = \"shoulder\"", "name = \"shoulder\"\nwheels = 4");
  const std::string unknown = error_of(extra);
  EXPECT_NE(unknown.find("p.toml:" + std::to_string(line_of(extra, "wheels"))), std::string::npos)
      << unknown;
  EXPECT_NE(unknown.find("unknown key 'wheels'"), std::string::npos) << unknown;
}

TEST(Plant, RefusesAToleranceOfNothingAndSaysWhichExist) {
  const auto with = [](const std::string& line) {
    return changed("  [joint.drive]", "  [joint.tolerance]\n  " + line + "\n\n  [joint.drive]");
  };
  const std::string text = with("intertia = 0.5");
  const std::string error = error_of(text);
  for (const char* words :
       {"tolerance of 'intertia'", "did you mean 'inertia'?",
        "joint 'shoulder' has:", "compliance.stiffness", "weight_scale", "controller_gain"})
    EXPECT_NE(error.find(words), std::string::npos) << words << " in " << error;
  EXPECT_TRUE(error.starts_with("p.toml:" + std::to_string(line_of(text, "intertia")) + ":"))
      << error;
  EXPECT_NE(error_of(with("stiffness_n_m_per_rad = 0.5")).find("did you mean 'stiffness'?"),
            std::string::npos)
      << "units are not part of a key";
  for (const char* key : {"inertia", "\"viscous_friction.damping\"", "viscous_friction_damping",
                          "damping", "creep", "controller_gain", "weight_scale"}) {
    const auto plant = parse_plant(with(std::string(key) + " = 0.3"), "p.toml");
    ASSERT_TRUE(plant.ok()) << plant.error().message;
    EXPECT_EQ(plant->joints[0].tolerance.size(), 1U);
  }
}

TEST(Plant, RefusesAnEffectOutsideTheVocabularyAndSaysWhichExist) {
  const std::string text = changed("id = \"backlash\"", "id = \"gremlins\"");
  const std::string error = error_of(text);
  EXPECT_NE(error.find("p.toml:" + std::to_string(line_of(text, "gremlins"))), std::string::npos)
      << error;
  EXPECT_NE(error.find("unknown effect 'gremlins'"), std::string::npos) << error;
  EXPECT_NE(error.find("compliance"), std::string::npos) << error;
  const std::string typed = error_of(changed("id = \"backlash\"", "id = \"backlsh\""));
  EXPECT_NE(typed.find("did you mean 'backlash'?"), std::string::npos) << typed;
}

TEST(Plant, RefusesValuesThatMakeNoSense) {
  EXPECT_NE(error_of(changed("kind = \"prismatic\"", "kind = \"wobbly\"")).find("wobbly"),
            std::string::npos);
  EXPECT_NE(error_of(changed("reduction = 136.196255507", "reduction = -1")).find("reduction"),
            std::string::npos);
  EXPECT_NE(error_of(changed("reduction = 136.196255507", "reduction = \"a\"")).find("number"),
            std::string::npos);
  EXPECT_NE(error_of(changed("mass_kg = 0.494", "mass_kg = -0.494")).find("mass_kg"),
            std::string::npos);
  EXPECT_NE(error_of(changed("inner_rate_hz = 10000", "inner_rate_hz = 10500")).find("multiple"),
            std::string::npos);
  EXPECT_NE(error_of(changed("[-0.14545,       0.0, ", "[-0.14545,       0.5, ")).find("diagonal"),
            std::string::npos);
  EXPECT_NE(error_of(changed("from = \"shoulder\"", "from = \"nose\"")).find("nose"),
            std::string::npos);
  EXPECT_NE(error_of(changed("name = \"elbow\"", "name = \"shoulder\"")).find("two joints"),
            std::string::npos);
  EXPECT_NE(error_of("robot = [").find("p.toml:1"), std::string::npos);
}

TEST(Plant, NeedsNothingThatARobotMayNotHave) {
  const std::string least = "[robot]\nname = \"r\"\n[[joint]]\nname = \"a\"\nkind = \"revolute\"\n";
  const auto plant = parse_plant(least, "p.toml");
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  EXPECT_EQ(plant->joints[0].reduction, 1.0);
  const auto again = parse_plant(plant_text(*plant), "p.toml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->joints, plant->joints);
  // A weight without gravity would weigh nothing in silence.
  const std::string heavy =
      least + "[joint.link]\nmass_kg = 1\ncom_m = [0, 0, 0]\ninertia_kg_m2 = [0, 0, 0]\n";
  EXPECT_NE(error_of(heavy).find("states no gravity_m_per_s2"), std::string::npos);
}

TEST(Plant, SaysThatAFileCannotBeOpened) {
  const auto plant = load_plant("/nonexistent/plant.toml");
  ASSERT_FALSE(plant.ok());
  EXPECT_EQ(plant.error().code, core::ErrorCode::kIo);
}

TEST(Plant, IsDescribedWithEveryEffectItHas) {
  const auto plant = load_plant(kPlantPath);
  ASSERT_TRUE(plant.ok());
  const std::string text = describe_plant(*plant);
  const std::string json = describe_plant_in_json(*plant);
  EXPECT_NE(json.find("\"stiffness_n_per_m\":25000"), std::string::npos) << json;
  for (const Joint& joint : plant->joints) {
    EXPECT_NE(text.find(joint.name), std::string::npos);
    for (const Effect& effect : joint.effects) {
      EXPECT_NE(text.find(effect.id), std::string::npos);
    }
  }
}

constexpr const char* kTwoJoints = R"(
[robot]
name = "two"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "one"
kind = "revolute"
motor_inertia_kg_m2 = 1e-5
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-5
  [[joint.effect]]
%s
[[joint]]
name = "two"
kind = "revolute"
motor_inertia_kg_m2 = 1e-5
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-5
)";

core::Result<Plant> with_effect(const std::string& effect) {
  std::string text = kTwoJoints;
  return parse_plant(text.replace(text.find("%s"), 2, effect), "two.toml");
}

TEST(Plant, LetsALaterJointDisturbAnEarlierOneButNoJointItself) {
  const std::string coupling = "id = \"coupling\"\nerror_rad_per_rad = 0.1\nfrom = ";
  const auto later = with_effect(coupling + "\"two\"");
  ASSERT_TRUE(later.ok()) << later.error().message;
  EXPECT_EQ(later->joints[0].find_effect("coupling")->from, "two");
  EXPECT_FALSE(with_effect(coupling + "\"one\"").ok());
}

TEST(Plant, TakesALoopByItsStrandsOrByItsShapeButWholeEitherWay) {
  const std::string id = "id = \"hysteresis\"\n";
  const auto shape = with_effect(id + "half_loop_rad = 0.1\nwidth_rad = 0.2\nfrom = \"two\"");
  ASSERT_TRUE(shape.ok()) << shape.error().message;
  EXPECT_EQ(shape->joints[0].find_effect("hysteresis"), nullptr)
      << "a loop over another joint's motion is not the joint's own strands";
  EXPECT_TRUE(with_effect(id + "stiffness_n_m_per_rad = 3.0\nyield_rad = 0.01").ok());
  const auto half = with_effect(id + "half_loop_rad = 0.1\nyield_rad = 0.2");
  ASSERT_FALSE(half.ok());
  EXPECT_NE(half.error().message.find("half_loop and width"), std::string::npos)
      << half.error().message;
}

TEST(Plant, TakesStretchPerRecordedLoadOnlyWithTheLoadsName) {
  const std::string id = "id = \"compliance\"\n";
  EXPECT_TRUE(with_effect(id + "from = \"force\"\nstretch_per_load_rad = 0.1").ok());
  EXPECT_FALSE(with_effect(id + "stretch_per_load_rad = 0.1").ok());
  EXPECT_FALSE(with_effect(id + "from = \"force\"\nstiffness_n_m_per_rad = 3.0\n"
                                "damping_n_m_s_per_rad = 1.0")
                   .ok());
}

TEST(EffectSpecs, GiveUnitsByTheKindOfJoint) {
  const EffectSpec* spec = find_effect_spec("compliance");
  ASSERT_NE(spec, nullptr);
  EXPECT_EQ(key_of(spec->parameters[0], JointKind::kRevolute), "stiffness_n_m_per_rad");
  EXPECT_EQ(key_of(spec->parameters[0], JointKind::kPrismatic), "stiffness_n_per_m");
  EXPECT_EQ(find_effect_spec("unknown"), nullptr);
}

/// A small turn of one motor moves joints through the plant's coupling and gains, errors included:
/// the joints' work is the motor's.
TEST(MotorEfforts, DoTheWorkOfTheJoints) {
  const Plant plant = load_plant(kPlantPath).value();
  Eigen::Matrix3d coupling = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gain;
  for (std::size_t j = 0; j < 3; ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    gain[row] = 1.0 + plant.joints[j].parameter("gain_error", "ratio");
    for (std::size_t k = 0; k < j; ++k)
      coupling(row, static_cast<Eigen::Index>(k)) = plant.coupling[j][k];
    for (const Effect& effect : plant.joints[j].effects) {
      if (effect.id == "coupling")
        coupling(row, static_cast<Eigen::Index>(*plant.joint_index(effect.from))) +=
            effect.parameters.at("error");
    }
  }
  const Eigen::Vector3d efforts(1.5, -2.0, 8.0);
  std::vector<Eigen::VectorXd> of_joints;
  for (const double effort : efforts) of_joints.push_back(Eigen::VectorXd::Constant(4, effort));
  const auto of_motors = motor_efforts(plant, of_joints);
  for (Eigen::Index motor = 0; motor < 3; ++motor) {
    const Eigen::Vector3d turn = 1e-3 * Eigen::Vector3d::Unit(motor);
    const Eigen::Vector3d moved =
        (Eigen::Matrix3d::Identity() - coupling).inverse() * gain.cwiseProduct(turn);
    EXPECT_NEAR(1e-3 * of_motors[static_cast<std::size_t>(motor)][3], efforts.dot(moved), 1e-12);
  }
}

/// The same of cables: one that follows a link pulls at it while the motors stand.
TEST(CableEfforts, DoTheWorkOfCablesOverLinks) {
  Plant plant = load_plant(kPlantPath).value();
  const std::vector<Eigen::VectorXd> of_joints = {Eigen::VectorXd::Constant(1, 1.5),
                                                  Eigen::VectorXd::Constant(1, -2.0),
                                                  Eigen::VectorXd::Constant(1, 8.0)};
  const auto silent = cable_efforts(plant, of_joints);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_EQ(silent[j][0], of_joints[j][0]);
  plant.joints[1].coupling_through = Through::kLink;
  plant.joints[2].coupling_through = Through::kDrive;
  const auto cables = cable_efforts(plant, of_joints);
  EXPECT_NEAR(cables[0][0], 1.5 - 2.0 * coupling_of(plant, 1, 0), 1e-12);
  EXPECT_EQ(cables[1][0], -2.0);
  // Where every cable follows links, it holds at unit ratios what motors feel.
  plant.joints[2].coupling_through = Through::kLink;
  for (Joint& joint : plant.joints)
    std::erase_if(joint.effects, [](const Effect& effect) { return effect.id == "gain_error"; });
  const auto all = cable_efforts(plant, of_joints);
  const auto motors = motor_efforts(plant, of_joints);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(all[j][0], motors[j][0], 1e-12);
}

TEST(Plant, TakesAMeasuredLoadFromOutside) {
  Plant plant = load_plant(kPlantPath).value();
  plant.joints[1].external_load = ExternalLoad{"sensor.tip", -0.5};
  const auto read = parse_plant(plant_text(plant), "again");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->joints[1].external_load, plant.joints[1].external_load);
  EXPECT_FALSE(read->joints[0].external_load);
  EXPECT_NE(describe_plant(*read).find("'sensor.tip'"), std::string::npos);

  const Eigen::VectorXd measured = Eigen::Vector2d(4.0, 6.0);
  std::vector<Eigen::VectorXd> efforts = {
      Eigen::VectorXd::Constant(2, 1.0), Eigen::VectorXd::Constant(2, 1.0), {}};
  add_external_loads(*read, {measured, measured, measured}, efforts);
  EXPECT_EQ(efforts[0], Eigen::VectorXd(Eigen::Vector2d(1.0, 1.0)));
  EXPECT_EQ(efforts[1], Eigen::VectorXd(Eigen::Vector2d(-1.0, -2.0)));
  EXPECT_EQ(efforts[2].size(), 0);
}

TEST(Plant, SaysWhatACoupledCableFollows) {
  const std::string text = plant_text(load_plant(kPlantPath).value());
  const auto with = [&](const std::string& joint, const std::string& word) {
    const std::string name = "name = \"" + joint + "\"\n";
    std::string more = text;
    more.insert(more.find(name) + name.size(), "coupling_through = \"" + word + "\"\n");
    return parse_plant(more, "test");
  };
  const auto said = with("elbow", "link");
  ASSERT_TRUE(said.ok()) << said.error().message;
  EXPECT_EQ(said->joints[1].coupling_through, Through::kLink);
  EXPECT_FALSE(said->joints[2].coupling_through);
  EXPECT_EQ(parse_plant(plant_text(*said), "again")->joints[1].coupling_through, Through::kLink);
  EXPECT_NE(describe_plant(*said).find("links"), std::string::npos);
  const auto unknown = with("elbow", "cable");
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("not one of link, drive"), std::string::npos);
  const auto uncoupled = with("shoulder", "link");
  ASSERT_FALSE(uncoupled.ok());
  EXPECT_NE(uncoupled.error().message.find("shoulder"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::physics
