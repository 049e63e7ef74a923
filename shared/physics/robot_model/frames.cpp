// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/frames.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <vector>

#include "physics/robot_model/model_defaults.hpp"
#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/model_names.hpp"

namespace ravencal::physics {
namespace {

using Eigen::AngleAxisd;
using Eigen::Index;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

/// Of all replicas of a document together: a robot has a thousand bodies at most.
constexpr int kMostReplicas = 10000;

std::optional<std::vector<double>> numbers_in(const char* text) {
  std::istringstream in(text);
  std::vector<double> out;
  for (double value = 0.0; in >> value;) out.push_back(value);
  if (!in.eof()) return std::nullopt;
  return out;
}

/// How a document measures and chains angles.
struct Angles {
  double unit_rad;
  std::string sequence;  ///< lower case: about the turned axes; upper case: the parent's

  explicit Angles(const RobotDocument& document)
      : unit_rad(compiler_word(document, "angle", "degree") == "radian" ? 1.0
                                                                        : std::numbers::pi / 180.0),
        sequence(compiler_word(document, "eulerseq", "xyz")) {}

  [[nodiscard]] bool valid() const {
    return sequence.size() == 3 && sequence.find_first_not_of("xyzXYZ") == std::string::npos;
  }
  [[nodiscard]] Quaterniond turn(const Vector3d& euler) const {
    Quaterniond out = Quaterniond::Identity();
    for (std::size_t k = 0; k < 3; ++k) {
      const char axis = sequence[k];
      const bool is_turned = axis >= 'x';
      const AngleAxisd step(unit_rad * euler[static_cast<Index>(k)],
                            Vector3d::Unit(axis - (is_turned ? 'x' : 'X')));
      out = is_turned ? out * step : step * out;
    }
    return out;
  }
};

class Frames {
 public:
  explicit Frames(RobotDocument& document)
      : document_(document), angles_(document), defaults_(document) {}

  core::Status put_in_place() {
    for (XMLElement* world = document_.root().FirstChildElement("worldbody"); world != nullptr;
         world = world->NextSiblingElement("worldbody"))
      RAVENCAL_RETURN_IF_ERROR(put_in_place(*world));
    return {};
  }

 private:
  core::Status put_in_place(XMLElement& parent) {
    for (XMLElement* child = parent.FirstChildElement(); child != nullptr;) {
      RAVENCAL_RETURN_IF_ERROR(put_in_place(*child));
      XMLElement* next = child->NextSiblingElement();
      if (is_named(*child, "replicate")) {
        RAVENCAL_RETURN_IF_ERROR(replicate(*child));
      } else if (is_named(*child, "frame")) {
        RAVENCAL_RETURN_IF_ERROR(dissolve(*child));
      }
      child = next;
    }
    return {};
  }

  /// `count` numbers of an attribute; empty where the element and its class have none.
  core::Result<std::optional<std::vector<double>>> numbers(const XMLElement& element,
                                                           const char* attribute,
                                                           std::size_t count) const {
    const char* text = defaults_.attribute(element, {element.Name()}, attribute);
    if (text == nullptr) return std::optional<std::vector<double>>();
    std::optional<std::vector<double>> out = numbers_in(text);
    if (!out || out->size() != count)
      return error_at(element, fmt::format("<{}> has {} '{}': {} numbers are wanted",
                                           element.Name(), attribute, text, count));
    return out;
  }

  core::Result<Vector3d> vector(const XMLElement& element, const char* attribute,
                                const Vector3d& otherwise) const {
    RAVENCAL_ASSIGN_OR_RETURN(const auto given, numbers(element, attribute, 3));
    return given ? Vector3d(given->data()) : otherwise;
  }

  core::Result<Quaterniond> turn_of(const XMLElement& element) const {
    RAVENCAL_ASSIGN_OR_RETURN(const auto quat, numbers(element, "quat", 4));
    RAVENCAL_ASSIGN_OR_RETURN(const auto about, numbers(element, "axisangle", 4));
    RAVENCAL_ASSIGN_OR_RETURN(const auto euler, numbers(element, "euler", 3));
    RAVENCAL_ASSIGN_OR_RETURN(const auto axes, numbers(element, "xyaxes", 6));
    RAVENCAL_ASSIGN_OR_RETURN(const auto z, numbers(element, "zaxis", 3));
    // Of several the library takes the last.
    if (about && !euler && !axes && !z)
      return Quaterniond(
          AngleAxisd(angles_.unit_rad * about->back(), Vector3d(about->data()).normalized()));
    if (euler && !angles_.valid())
      return error_at(element, fmt::format("eulerseq is '{}'", angles_.sequence));
    if (euler) return angles_.turn(Vector3d(euler->data()));
    if (axes && !z) {
      Eigen::Matrix3d r;
      r.col(0) = Vector3d(axes->data()).normalized();
      const Vector3d y(axes->data() + 3);
      r.col(1) = (y - r.col(0).dot(y) * r.col(0)).normalized();
      r.col(2) = r.col(0).cross(r.col(1));
      return Quaterniond(r);
    }
    if (z) return Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d(z->data()));
    if (quat) return Quaterniond((*quat)[0], (*quat)[1], (*quat)[2], (*quat)[3]).normalized();
    return Quaterniond::Identity();
  }

  core::Result<Isometry3d> pose_of(const XMLElement& element) const {
    RAVENCAL_ASSIGN_OR_RETURN(const Vector3d at, vector(element, "pos", Vector3d::Zero()));
    RAVENCAL_ASSIGN_OR_RETURN(const Quaterniond turn, turn_of(element));
    return Isometry3d(Eigen::Translation3d(at) * turn);
  }

  /// Errors: a class turns the element by a word that would win over this one.
  core::Status set_pose(XMLElement& element, const Isometry3d& pose) const {
    for (const char* other : {"axisangle", "xyaxes", "zaxis", "euler"}) {
      if (defaults_.of_class(element, {element.Name()}, other) != nullptr)
        return error_at(element, fmt::format("the class of this <{}> in a <frame> states {}: state "
                                             "the class's turn as quat",
                                             element.Name(), other));
      element.DeleteAttribute(other);
    }
    const Quaterniond turn(pose.linear());
    element.SetAttribute("pos", text_of(pose.translation()).c_str());
    element.SetAttribute("quat", numbers_text(turn.w(), turn.x(), turn.y(), turn.z()).c_str());
    return {};
  }

  /// Writes the child of a frame as a child of what the frame stands in.
  core::Status move_by(const Isometry3d& frame, XMLElement& child) const {
    RAVENCAL_ASSIGN_OR_RETURN(const auto ends, numbers_of_ends(child));
    if (ends) {
      const Vector3d one = frame * Vector3d(ends->data()),
                     other = frame * Vector3d(ends->data() + 3);
      child.SetAttribute("fromto", (text_of(one) + " " + text_of(other)).c_str());
      return {};
    }
    if (is_named(child, "joint") || is_named(child, "light")) {
      const bool is_joint = is_named(child, "joint");
      const char* direction = is_joint ? "axis" : "dir";
      RAVENCAL_ASSIGN_OR_RETURN(const Vector3d at, vector(child, "pos", Vector3d::Zero()));
      RAVENCAL_ASSIGN_OR_RETURN(
          const Vector3d along,
          vector(child, direction, is_joint ? Vector3d::UnitZ() : Vector3d(-Vector3d::UnitZ())));
      child.SetAttribute("pos", text_of(frame * at).c_str());
      child.SetAttribute(direction, text_of(frame.linear() * along).c_str());
      return {};
    }
    for (const char* placed : {"body", "geom", "site", "camera"}) {
      if (!is_named(child, placed)) continue;
      RAVENCAL_ASSIGN_OR_RETURN(const Isometry3d own, pose_of(child));
      return set_pose(child, frame * own);
    }
    if (is_named(child, "freejoint")) return {};
    return error_at(child, fmt::format("<{}> stands in a <frame>", child.Name()));
  }

  core::Result<std::optional<std::vector<double>>> numbers_of_ends(const XMLElement& child) const {
    if (is_named(child, "geom") || is_named(child, "site")) return numbers(child, "fromto", 6);
    return std::optional<std::vector<double>>();
  }

  /// Puts the frame's children in its place.
  core::Status dissolve(XMLElement& frame) {
    RAVENCAL_ASSIGN_OR_RETURN(const Isometry3d pose, pose_of(frame));
    XMLNode* before = &frame;
    for (XMLElement* child = frame.FirstChildElement(); child != nullptr;) {
      XMLElement* next = child->NextSiblingElement();
      RAVENCAL_RETURN_IF_ERROR(move_by(pose, *child));
      const char* own = is_named(*child, "body") ? "childclass" : "class";
      const char* around = frame.Attribute("childclass");
      if (around != nullptr && child->Attribute(own) == nullptr) child->SetAttribute(own, around);
      before = frame.Parent()->InsertAfterChild(before, child);
      child = next;
    }
    frame.Parent()->DeleteChild(&frame);
    return {};
  }

  /// Puts its copies in its place, each behind the one before it by the same step.
  core::Status replicate(XMLElement& element) {
    RAVENCAL_ASSIGN_OR_RETURN(const auto stated, numbers(element, "count", 1));
    const double wanted = stated ? stated->front() : 0.0;
    const bool is_count = wanted >= 1.0 && wanted <= kMostReplicas && wanted == std::floor(wanted);
    const int count = is_count ? static_cast<int>(wanted) : 0;
    made_ += count;
    if (count < 1 || made_ > kMostReplicas)
      return error_at(element, fmt::format("<replicate> makes 1 to {} copies", kMostReplicas));
    RAVENCAL_ASSIGN_OR_RETURN(const Vector3d offset, vector(element, "offset", Vector3d::Zero()));
    RAVENCAL_ASSIGN_OR_RETURN(const Vector3d euler, vector(element, "euler", Vector3d::Zero()));
    if (!angles_.valid())
      return error_at(element, fmt::format("eulerseq is '{}'", angles_.sequence));
    const char* separator = element.Attribute("sep");
    const std::size_t digits = std::to_string(count).size();
    std::vector<std::string> suffixes;
    for (int k = 0; k < count; ++k)
      suffixes.push_back(fmt::format("{}{:0{}}", separator != nullptr ? separator : "", k, digits));
    ModelNames names = names_in(element);
    Vector3d at = Vector3d::Zero();
    XMLNode* before = &element;
    for (std::size_t k = 0; k < suffixes.size(); ++k) {
      // Angles add up, each about its axis; steps follow the copy before.
      const Quaterniond turn = angles_.turn(static_cast<double>(k) * euler);
      XMLElement* frame = document_.copy_of(element);
      frame->SetName("frame");
      RAVENCAL_RETURN_IF_ERROR(set_pose(*frame, Eigen::Translation3d(at) * turn));
      rename(*frame, names, "", suffixes[k]);
      XMLNode* behind = element.Parent()->InsertAfterChild(before, frame)->NextSibling();
      RAVENCAL_RETURN_IF_ERROR(dissolve(*frame));
      before = behind != nullptr ? behind->PreviousSibling() : element.Parent()->LastChild();
      at += turn * offset;
    }
    element.Parent()->DeleteChild(&element);
    for (const char* section : {"tendon", "equality", "actuator"})
      for (XMLElement* e : children_of_sections(document_, section))
        if (references_of(*e, names).inside > 0) copy_for_each(*e, names, suffixes);
    return {};
  }

  /// What refers to something that is there several times is there as often. A tendon's own name
  /// counts among those that others refer to.
  void copy_for_each(XMLElement& element, ModelNames& names,
                     const std::vector<std::string>& suffixes) {
    if (is_named(*element.Parent()->ToElement(), "tendon")) add_own_name(element, names);
    XMLNode* before = &element;
    for (const std::string& suffix : suffixes) {
      XMLElement* copy = document_.copy_of(element);
      rename_with_references(*copy, names, "", suffix);
      before = element.Parent()->InsertAfterChild(before, copy);
    }
    element.Parent()->DeleteChild(&element);
  }

  RobotDocument& document_;
  Angles angles_;
  ModelDefaults defaults_;
  int made_ = 0;
};

}  // namespace

core::Status put_in_place(RobotDocument& document) { return Frames(document).put_in_place(); }

}  // namespace ravencal::physics
