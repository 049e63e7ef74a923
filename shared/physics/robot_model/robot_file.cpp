// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/robot_file.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <functional>
#include <regex>

#include "physics/robot_model/robot_document.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

/// More unknown words than this are another language.
constexpr int kMostRepairs = 500;

/// Calls `visit` on each element below; true from it removes the element.
void prune(XMLElement& parent, const std::function<bool(XMLElement&)>& visit) {
  for (XMLElement* child = parent.FirstChildElement(); child != nullptr;) {
    XMLElement* next = child->NextSiblingElement();
    if (visit(*child))
      parent.DeleteChild(child);
    else
      prune(*child, visit);
    child = next;
  }
}

class Repair {
 public:
  Repair(RobotDocument& document, std::vector<std::string>& notes)
      : document_(document), notes_(notes) {}

  /// Newer versions take a range for a limit unless told otherwise; this one asks.
  void take_ranges_for_limits() {
    if (document_.is_urdf()) return;
    XMLElement& root = document_.root();
    XMLElement* compiler = root.FirstChildElement("compiler");
    if (compiler == nullptr) {
      compiler = document_.xml.NewElement("compiler");
      root.InsertFirstChild(compiler);
    }
    if (compiler->Attribute("autolimits") == nullptr) compiler->SetAttribute("autolimits", "true");
  }

  /// Pictures and shapes of contact: a plant has neither, and their files need not be there. Bodies
  /// whose inertia follows from meshes keep them.
  void leave_out_shapes() {
    const XMLElement* compiler = document_.root().FirstChildElement("compiler");
    const bool weighs_shapes =
        compiler != nullptr && compiler->Attribute("inertiafromgeom", "true") != nullptr;
    std::size_t meshes = 0;
    prune(document_.root(), [&](XMLElement& e) {
      const bool is_asset = is_named(e, "asset") || is_named(e, "visual") ||
                            is_named(e, "collision") || is_named(e, "statistic") ||
                            is_named(e, "keyframe") || is_named(e, "sensor") ||
                            is_named(e, "contact") || is_named(e, "size");
      const XMLNode* parent = e.Parent();
      const bool weighed =
          !weighs_shapes && parent != nullptr && parent->FirstChildElement("inertial") != nullptr;
      const bool is_shape = is_named(e, "geom") && (weighed || e.Attribute("mesh") != nullptr ||
                                                    e.Attribute("hfield") != nullptr);
      meshes += is_named(e, "geom") && !weighed && e.Attribute("mesh") != nullptr ? 1 : 0;
      return is_asset || is_shape;
    });
    if (meshes > 0)
      notes_.push_back(fmt::format(
          "{} shapes were left out whose mesh alone says what their body weighs: state the inertia "
          "of these bodies",
          meshes));
  }

  /// Removes what the library names as unknown; false where it names nothing of the kind.
  bool without(const std::string& refusal) {
    static const std::regex kAttribute("unrecognized attribute: '([^']+)'");
    static const std::regex kValue("invalid keyword: '([^']+)'");
    static const std::regex kPlace("Element '([^']+)'");
    std::smatch word, place;
    if (!std::regex_search(refusal, place, kPlace)) return false;
    const std::string element = place[1];
    if (std::regex_search(refusal, word, kAttribute)) return drop_attribute(element, word[1], {});
    if (std::regex_search(refusal, word, kValue)) return drop_attribute(element, {}, word[1]);
    return refusal.find("unrecognized element") != std::string::npos && drop_element(element);
  }

 private:
  void note_unknown(const std::string& what) {
    notes_.push_back(fmt::format("{} is not known to the installed MuJoCo {}: left out", what,
                                 mj_versionString()));
  }

  /// Of that name or, without one, of that value.
  bool drop_attribute(const std::string& element, const std::string& name,
                      const std::string& value) {
    std::string dropped;
    prune(document_.root(), [&](XMLElement& e) {
      if (!is_named(e, element)) return false;
      for (const tinyxml2::XMLAttribute* a = e.FirstAttribute(); a != nullptr;) {
        const tinyxml2::XMLAttribute* next = a->Next();
        if (name.empty() ? a->Value() == value : a->Name() == name) {
          dropped = name.empty() ? fmt::format("{}=\"{}\"", a->Name(), value) : name;
          e.DeleteAttribute(a->Name());
        }
        a = next;
      }
      return false;
    });
    if (!dropped.empty()) note_unknown(fmt::format("{} of <{}>", dropped, element));
    return !dropped.empty();
  }

  bool drop_element(const std::string& element) {
    bool any = false;
    prune(document_.root(), [&](XMLElement& e) { return is_named(e, element) && (any = true); });
    if (any) note_unknown(fmt::format("<{}>", element));
    return any;
  }

  RobotDocument& document_;
  std::vector<std::string>& notes_;
};

}  // namespace

core::Result<RobotFile> compile_robot(RobotDocument& document, const fs::path& path) {
  RobotFile out;
  Repair repair(document, out.notes);
  repair.take_ranges_for_limits();
  repair.leave_out_shapes();
  CompiledModel result;
  for (int pass = 0; pass < kMostRepairs; ++pass) {
    result = compile_model(document.text(), document.is_urdf() ? "robot.urdf" : "robot.xml");
    if (result.model || !repair.without(result.refusal)) break;
  }
  if (!result.model) {
    std::replace(result.refusal.begin(), result.refusal.end(), '\n', ' ');
    return core::data_error(fmt::format("{}: MuJoCo {} refuses it: {}", path.string(),
                                        mj_versionString(), result.refusal));
  }
  out.model = std::move(result.model);
  return out;
}

core::Result<RobotFile> read_robot_file(const fs::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::unique_ptr<RobotDocument> document,
                            read_robot_document(path));
  return compile_robot(*document, path);
}

}  // namespace ravencal::physics
