// SPDX-License-Identifier: Apache-2.0
//
// Whatever a model can state of a plant comes back from it: the plant that was written and the one
// that is read again predict the same along any motion.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <algorithm>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "physics/plant.hpp"
#include "physics/predict/predict.hpp"
#include "physics/robot_model/robot_writer.hpp"

namespace {

using namespace ravencal::physics;
namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::VectorXd;

/// Of the largest effort or position that the two predictions are of: a cable's balance is found
/// to 1e-10 of its load, and degrees and principal axes round.
constexpr double kSamePrediction = 1e-6;

/// Effort, N m or N: behind a gap that no spring follows the replay's cable has 1e12 of them per
/// unit, and a double of its stretch has 1e-17.
constexpr double kStiffGap = 1e-3;

bool maybe() { return *rc::gen::arbitrary<bool>(); }
double between(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1'000'001);
}
std::string draw_vector(double reach) {
  return fmt::format("{} {} {}", between(-reach, reach), between(-reach, reach),
                     between(-reach, reach));
}
std::string draw_turn() { return fmt::format("{} {}", between(0.1, 1.0), draw_vector(1.0)); }

std::string draw_inertial() {
  return fmt::format("<inertial pos=\"{}\" quat=\"{}\" mass=\"{}\" diaginertia=\"{} {} {}\"/>",
                     draw_vector(0.2), draw_turn(), between(0.1, 2.0), between(2e-3, 3e-3),
                     between(2e-3, 3e-3), between(2e-3, 3e-3));
}

std::string draw_joint(int number, bool slides) {
  std::string text =
      fmt::format("<joint name=\"j{}\" type=\"{}\" axis=\"{} 1\" pos=\"{}\"", number,
                  slides ? "slide" : "hinge",
                  fmt::format("{} {}", between(-1.0, 1.0), between(-1.0, 1.0)), draw_vector(0.1));
  if (maybe()) text += fmt::format(" ref=\"{}\"", between(-0.3, 0.3));
  if (maybe()) text += fmt::format(" frictionloss=\"{}\"", between(0.0, 0.3));
  if (maybe()) text += fmt::format(" damping=\"{}\"", between(0.0, 0.3));
  return text + fmt::format(" armature=\"{}\"/>", between(0.01, 0.1));
}

/// The body with those that it carries: a tree, a body that no joint moves on some.
std::string draw_body(int number, const std::vector<int>& parents) {
  std::string text =
      fmt::format("<body name=\"b{}\" pos=\"{}\" quat=\"{}\">{}{}", number, draw_vector(0.3),
                  draw_turn(), draw_joint(number, maybe()), draw_inertial());
  if (maybe()) text += fmt::format("<body pos=\"{}\">{}</body>", draw_vector(0.1), draw_inertial());
  for (std::size_t k = 0; k < parents.size(); ++k)
    if (parents[k] == number) text += draw_body(static_cast<int>(k), parents);
  return text + "</body>";
}

std::string draw_actuator(int joint) {
  const std::string common = fmt::format(
      " joint=\"j{}\" gear=\"{}\"{}/>", joint, between(0.5, 5.0),
      maybe() ? fmt::format(" forcelimited=\"true\" forcerange=\"-{0} {0}\"", between(1.0, 9.0))
              : "");
  switch (*rc::gen::inRange(0, 4)) {
    case 0:
      return "<motor" + common;
    case 1:
      return fmt::format("<position kp=\"{}\"", between(5.0, 50.0)) + common;
    case 2:
      return fmt::format("<general gainprm=\"{0}\" biastype=\"affine\" biasprm=\"0.1 -{0} -0.3\"",
                         between(5.0, 50.0)) +
             common;
    default:
      return "";
  }
}

std::string draw_model() {
  const int count = *rc::gen::inRange(1, 5);
  std::vector<int> parents;
  for (int k = 0; k < count; ++k) parents.push_back(*rc::gen::inRange(-1, k));
  std::string bodies, actuators;
  for (int k = 0; k < count; ++k) {
    if (parents[static_cast<std::size_t>(k)] < 0) bodies += draw_body(k, parents);
    actuators += draw_actuator(k);
  }
  return fmt::format(
      "<mujoco><compiler angle=\"{}\"/><option gravity=\"{}\"/><worldbody>{}</worldbody>"
      "<actuator>{}</actuator>{}</mujoco>",
      maybe() ? "radian" : "degree", draw_vector(9.0), bodies, actuators,
      count > 1 && maybe()
          ? "<equality><joint joint1=\"j1\" joint2=\"j0\" polycoef=\"0 0.3 0 0 0\"/></equality>"
          : "");
}

void set(Joint& joint, const char* effect, const char* parameter, double value) {
  for (Effect& e : joint.effects) {
    if (e.id != effect) continue;
    e.parameters[parameter] = value;
    return;
  }
  joint.effects.push_back({effect, "", {{parameter, value}}});
}

/// All that MJCF can state, as far as the model has a place for it.
Plant draw_changes(Plant plant) {
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    Joint& joint = plant.joints[j];
    if (maybe()) set(joint, "coulomb_friction", "level", between(0.0, 0.5));
    if (maybe()) set(joint, "viscous_friction", "damping", between(0.0, 0.5));
    if (maybe()) joint.motor_inertia_kg_m2 *= between(0.5, 2.0);
    if (maybe()) joint.link.mass_kg *= between(0.5, 2.0);
    if (maybe()) joint.link.com_m[0] += 0.01;
    if (maybe()) set(joint, "torque_constant", "ratio", between(-0.2, 0.2));
    if (maybe()) set(joint, "effort_offset", "offset", between(-0.2, 0.2));
    if (maybe()) set(joint, "saturation", "limit", between(1.0, 5.0));
    if (joint.controller && maybe()) joint.controller->kp_n_m_per_rad *= between(0.8, 1.2);
    if (maybe()) set(joint, "backlash", "half_width", between(1e-3, 1e-2));
    if (maybe()) {
      set(joint, "compliance", "stiffness", between(100.0, 1000.0));
      set(joint, "compliance", "damping", between(0.0, 1.0));
    }
    for (std::size_t k = 0; k < j; ++k)
      if (plant.coupling[j][k] != 0.0 && maybe())
        joint.effects.push_back({"coupling", plant.joints[k].name, {{"error", 0.05}}});
  }
  if (maybe()) plant.payload = {between(0.1, 1.0), {0.1, 0.0, between(0.0, 0.1)}};
  return plant;
}

Prediction along_a_motion(const Plant& plant) {
  constexpr Index kRows = 150;
  ForcedMotion forced;
  forced.t_s = VectorXd::LinSpaced(kRows, 0.0, 1.5);
  forced.fresh.assign(kRows, 0);
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const double rate = 3.0 + 1.3 * static_cast<double>(j);
    const Eigen::ArrayXd phase = rate * forced.t_s.array();
    forced.motors.push_back(
        {0.4 * phase.sin(), 0.4 * rate * phase.cos(), -0.4 * rate * rate * phase.sin(), 0.0});
  }
  return *predict(plant, forced);
}

bool same(const VectorXd& one, const VectorXd& other, double besides) {
  const double allowed = kSamePrediction * one.cwiseAbs().maxCoeff() + besides;
  return (one - other).cwiseAbs().maxCoeff() <= allowed;
}

RC_GTEST_PROP(RobotWriter, WhatMjcfStatesIsThePlantAgain, ()) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("robot_writer_{}", ::getpid());
  fs::create_directories(folder);
  const fs::path model = folder / "model.xml", out = folder / "out.xml";
  const std::string text = draw_model();
  std::ofstream(model) << text;
  const auto given = load_plant(model);
  RC_ASSERT(given.ok());
  const Plant wanted = draw_changes(*given);
  const auto written = write_robot(wanted, model, out);
  if (!written.ok()) RC_FAIL(text + "\n" + written.error().message);
  std::ofstream(out) << written->text;
  const auto read = load_plant(out);
  RC_ASSERT(read.ok());
  fs::remove_all(folder);
  const bool stiff_gap =
      std::any_of(wanted.joints.begin(), wanted.joints.end(), [](const Joint& j) {
        return j.parameter("backlash", "half_width") > 0.0 &&
               j.parameter("compliance", "stiffness") <= 0.0;
      });
  const double besides = stiff_gap ? kStiffGap : 1e-9;
  const Prediction first = along_a_motion(wanted), second = along_a_motion(*read);
  for (std::size_t j = 0; j < wanted.joints.size(); ++j) {
    const Joint& was = wanted.joints[j];
    const Joint& is = read->joints[j];
    RC_ASSERT(same(first.position[j], second.position[j], 1e-9));
    RC_ASSERT(same(first.tension[j], second.tension[j], besides));
    // A motor's gear carries the torque constant, and efforts are asked in its units.
    const auto says = [&](std::string_view effect) {
      return std::any_of(written->not_expressed.begin(), written->not_expressed.end(),
                         [&](const std::string& line) {
                           return line.starts_with(fmt::format("{}: {}", was.name, effect));
                         });
    };
    const double ratio = 1.0 + was.parameter("torque_constant", "ratio");
    const double offset = was.parameter("effort_offset", "offset");
    const VectorXd force = ratio * (first.effort[j].array() - offset).matrix();
    const VectorXd again =
        (second.effort[j].array() - is.parameter("effort_offset", "offset")).matrix();
    RC_ASSERT(same(force, again, besides));
    if (!says("effort_offset") && !says("torque_constant"))
      RC_ASSERT(std::abs(is.parameter("effort_offset", "offset") - ratio * offset) < 1e-9);
    if (!says("saturation") && was.parameter("saturation", "limit") > 0.0 &&
        !says("torque_constant"))
      RC_ASSERT(std::abs(is.parameter("saturation", "limit") -
                         ratio * was.parameter("saturation", "limit")) < 1e-9);
    if (was.controller && !says("gains") && !says("torque_constant"))
      RC_ASSERT(std::abs(is.controller->kp_n_m_per_rad - ratio * was.controller->kp_n_m_per_rad) <
                1e-9 * was.controller->kp_n_m_per_rad);
  }
}

}  // namespace
