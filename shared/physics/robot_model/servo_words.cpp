// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "physics/robot_model/model_defaults.hpp"
#include "physics/robot_model/model_words.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

using tinyxml2::XMLElement;

std::string name_or_none(const XMLElement& element) {
  const char* name = element.Attribute("name");
  return name != nullptr ? name : "without a name";
}

}  // namespace

ServoWords ServoWords::take(RobotDocument& document, std::vector<std::string>& notes) {
  ServoWords out;
  const ModelDefaults defaults(document);
  for (const XMLElement* e : children_of_sections(document, "actuator")) {
    Servo servo;
    if (is_named(*e, "position")) {
      const auto number = [&](const char* attribute) {
        const char* text = defaults.attribute(*e, {"position"}, attribute);
        return text != nullptr ? std::strtod(text, nullptr) : 0.0;
      };
      servo = {number("kv"), number("dampratio")};
      if (number("timeconst") > 0.0)
        notes.push_back(
            fmt::format("{}: timeconst of actuator {} is left out: a plant's servo has "
                        "no lag",
                        RobotDocument::where(*e), name_or_none(*e)));
    }
    out.servos_.push_back(servo);
  }
  for (const char* word : {"kv", "dampratio", "timeconst", "inheritrange"})
    take_away(document.root(), "position", word);
  return out;
}

/// A ratio of 1 is that of a servo which just does not overshoot, with the joint's inertia at the
/// model's first pose.
void ServoWords::apply(mjModel& model) const {
  for (std::size_t a = 0; a < servos_.size() && a < static_cast<std::size_t>(model.nu); ++a) {
    const double kp = model.actuator_gainprm[a * mjNGAIN];
    double kv = servos_[a].kv;
    if (servos_[a].dampratio > 0.0 && model.actuator_trntype[a] == mjTRN_JOINT) {
      const int dof = model.jnt_dofadr[model.actuator_trnid[2 * a]];
      const double gear = model.actuator_gear[6 * a];
      kv = servos_[a].dampratio * 2.0 * std::sqrt(kp * model.dof_M0[dof]) / std::abs(gear);
    }
    if (kv > 0.0) model.actuator_biasprm[a * mjNBIAS + 2] = -kv;
  }
}

EffortLimits EffortLimits::take(RobotDocument& document, std::vector<std::string>& notes) {
  EffortLimits out;
  const ModelDefaults defaults(document);
  for (const XMLElement* joint : tree_of(document).joints) {
    const char* text = defaults.attribute(*joint, {"joint"}, "actuatorfrcrange");
    const char* limited = defaults.attribute(*joint, {"joint"}, "actuatorfrclimited");
    double low = 0.0, high = 0.0;
    const bool holds = limited == nullptr || std::string_view(limited) != "false";
    if (text != nullptr && holds) std::istringstream(text) >> low >> high;
    if (high > 0.0 && low != -high)
      notes.push_back(
          fmt::format("{}: actuatorfrcrange {} of joint {} is taken by its upper end: a plant's "
                      "limit is the same to both sides",
                      RobotDocument::where(*joint), text, name_or_none(*joint)));
    const char* name = joint->Attribute("name");
    out.limits_.push_back({name != nullptr ? name : "", std::max(0.0, high)});
  }
  for (const char* word : {"actuatorfrcrange", "actuatorfrclimited"})
    take_away(document.root(), "joint", word);
  return out;
}

std::map<std::string, double, std::less<>> EffortLimits::of(const mjModel& model) const {
  std::map<std::string, double, std::less<>> out;
  const bool same_joints = limits_.size() == static_cast<std::size_t>(model.njnt);
  for (std::size_t j = 0; j < limits_.size(); ++j) {
    if (!(limits_[j].effort > 0.0) || (limits_[j].joint.empty() && !same_joints)) continue;
    out[limits_[j].joint.empty() ? joint_name(model, static_cast<int>(j)) : limits_[j].joint] =
        limits_[j].effort;
  }
  return out;
}

}  // namespace ravencal::physics
