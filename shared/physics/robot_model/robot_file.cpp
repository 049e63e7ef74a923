// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/robot_file.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <functional>
#include <regex>

#include "core/whole_file.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

/// More unknown words than this are another language.
constexpr int kMostRepairs = 500;
constexpr int kMostIncludes = 100;

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

bool is(const XMLElement& element, std::string_view name) { return element.Name() == name; }

class Repair {
 public:
  Repair(const fs::path& path, std::vector<std::string>& notes) : path_(path), notes_(notes) {}

  core::Status open() {
    RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path_));
    if (document_.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS)
      return core::data_error(fmt::format("{}:{}: is not XML: {}", path_.string(),
                                          document_.ErrorLineNum(), document_.ErrorName()));
    if (document_.RootElement() == nullptr)
      return core::data_error(fmt::format("{}: is empty", path_.string()));
    int left = kMostIncludes;
    return include(*document_.RootElement(), left);
  }

  [[nodiscard]] bool is_urdf() const { return is(*document_.RootElement(), "robot"); }

  [[nodiscard]] std::string text() const {
    tinyxml2::XMLPrinter printer;
    document_.Print(&printer);
    return printer.CStr();
  }

  /// Newer versions take a range for a limit unless told otherwise; this one asks.
  void take_ranges_for_limits() {
    if (is_urdf()) return;
    XMLElement& root = *document_.RootElement();
    XMLElement* compiler = root.FirstChildElement("compiler");
    if (compiler == nullptr) {
      compiler = document_.NewElement("compiler");
      root.InsertFirstChild(compiler);
    }
    if (compiler->Attribute("autolimits") == nullptr) compiler->SetAttribute("autolimits", "true");
  }

  /// Pictures and shapes of contact: a plant has neither, and their files need not be there. Bodies
  /// whose inertia follows from meshes keep them.
  void leave_out_shapes() {
    const XMLElement* compiler = document_.RootElement()->FirstChildElement("compiler");
    const bool weighs_shapes =
        compiler != nullptr && compiler->Attribute("inertiafromgeom", "true") != nullptr;
    std::size_t meshes = 0;
    prune(*document_.RootElement(), [&](XMLElement& e) {
      const bool is_asset = is(e, "asset") || is(e, "visual") || is(e, "collision") ||
                            is(e, "statistic") || is(e, "keyframe") || is(e, "sensor") ||
                            is(e, "contact") || is(e, "size");
      const XMLNode* parent = e.Parent();
      const bool weighed =
          !weighs_shapes && parent != nullptr && parent->FirstChildElement("inertial") != nullptr;
      const bool is_shape = is(e, "geom") && (weighed || e.Attribute("mesh") != nullptr ||
                                              e.Attribute("hfield") != nullptr);
      meshes += is(e, "geom") && !weighed && e.Attribute("mesh") != nullptr ? 1 : 0;
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
    prune(*document_.RootElement(), [&](XMLElement& e) {
      if (!is(e, element)) return false;
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
    prune(*document_.RootElement(), [&](XMLElement& e) { return is(e, element) && (any = true); });
    if (any) note_unknown(fmt::format("<{}>", element));
    return any;
  }

  /// Puts the children of included files in the place of the elements that name them.
  core::Status include(XMLElement& parent, int& left) {
    for (XMLElement* child = parent.FirstChildElement(); child != nullptr;) {
      XMLElement* next = child->NextSiblingElement();
      const char* file = is(*child, "include") ? child->Attribute("file") : nullptr;
      if (file == nullptr) {
        RAVENCAL_RETURN_IF_ERROR(include(*child, left));
        child = next;
        continue;
      }
      if (--left < 0) return core::data_error(fmt::format("{}: includes itself", path_.string()));
      const fs::path other = path_.parent_path() / file;
      RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(other));
      XMLDocument included;
      if (included.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS ||
          included.RootElement() == nullptr)
        return core::data_error(fmt::format("{}: is not XML", other.string()));
      XMLNode* before = child;
      for (XMLElement* e = included.RootElement()->FirstChildElement(); e != nullptr;
           e = e->NextSiblingElement())
        before = parent.InsertAfterChild(before, e->DeepClone(&document_));
      next = child->NextSiblingElement();
      parent.DeleteChild(child);
      child = next;
    }
    return {};
  }

  fs::path path_;
  std::vector<std::string>& notes_;
  XMLDocument document_;
};

}  // namespace

core::Result<RobotFile> read_robot_file(const fs::path& path) {
  RobotFile out;
  Repair repair(path, out.notes);
  RAVENCAL_RETURN_IF_ERROR(repair.open());
  repair.take_ranges_for_limits();
  repair.leave_out_shapes();
  CompiledModel result;
  for (int pass = 0; pass < kMostRepairs; ++pass) {
    result = compile_model(repair.text(), repair.is_urdf() ? "robot.urdf" : "robot.xml");
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

}  // namespace ravencal::physics
