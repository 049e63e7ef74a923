// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/robot_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tinyxml2.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <regex>
#include <set>

#include "physics/robot_model/model_defaults.hpp"
#include "physics/robot_model/robot_document.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

/// More unknown words than this are another language.
constexpr int kMostRepairs = 500;

/// What a robot has beside its parts, and how it is counted; null: not at all.
struct LeftOut {
  const char* element;
  const char* said;
};
constexpr LeftOut kLeftOut[] = {
    {"visual", nullptr},       {"camera", nullptr},    {"light", nullptr},
    {"collision", nullptr},    {"statistic", nullptr}, {"size", nullptr},
    {"keyframe", "keyframes"}, {"sensor", "sensors"},  {"contact", "exceptions of contact"}};

/// The element itself or one in it that moves, weighs or drives.
const XMLElement* part_of_robot(const XMLElement& element) {
  for (const char* part : {"body", "joint", "freejoint", "inertial", "actuator", "flexcomp"})
    if (is_named(element, part)) return &element;
  if (is_named(*element.Parent()->ToElement(), "actuator")) return &element;
  for (const XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
    if (const XMLElement* part = part_of_robot(*e)) return part;
  return nullptr;
}

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
  Repair(RobotDocument& document, const fs::path& path, std::vector<std::string>& notes)
      : document_(document), path_(path), notes_(notes) {}

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

  /// Pictures and shapes of contact: a plant has neither, and their files need not be there. Shapes
  /// that alone say what their body weighs stay, of meshes those that can be read.
  void leave_out_shapes() {
    const bool weighs_shapes = compiler_word(document_, "inertiafromgeom", "auto") == "true";
    const ModelDefaults defaults(document_);
    const std::set<std::string> readable = readable_meshes();
    std::set<std::string> weighing, wrapped;
    for (const XMLElement* tendon : children_of_sections(document_, "tendon"))
      for (const XMLElement* e = tendon->FirstChildElement(); e != nullptr;
           e = e->NextSiblingElement())
        if (const char* geom = e->Attribute("geom")) wrapped.insert(geom);
    std::map<std::string, std::size_t> count;
    prune(document_.root(), [&](XMLElement& e) {
      const XMLNode* parent = e.Parent();
      if (!is_named(e, "geom") || parent == nullptr || is_named(*parent->ToElement(), "default"))
        return false;
      const char* mesh = defaults.attribute(e, {"geom"}, "mesh");
      const bool weighs = weighs_shapes || parent->FirstChildElement("inertial") == nullptr;
      if (mesh == nullptr && e.Attribute("name") != nullptr &&
          wrapped.contains(e.Attribute("name")))
        return false;
      const bool is_field = defaults.attribute(e, {"geom"}, "hfield") != nullptr;
      if (weighs && !is_field && (mesh == nullptr || readable.contains(mesh))) {
        if (mesh == nullptr) return false;
        const std::string name = mesh;
        weighing.insert(name);
        e.SetAttribute("type", "mesh");
        e.SetAttribute("mesh", name.c_str());
        return false;
      }
      unread_ += weighs && mesh != nullptr ? 1 : 0;
      ++count["shapes"];
      return true;
    });
    prune(document_.root(), [&](XMLElement& e) {
      const XMLNode* parent = e.Parent();
      if (parent != nullptr && parent->ToElement() != nullptr &&
          is_named(*parent->ToElement(), "asset"))
        return !is_named(e, "mesh") || !weighing.contains(asset_name(e));
      const auto kind =
          std::find_if(std::begin(kLeftOut), std::end(kLeftOut),
                       [&](const LeftOut& left) { return is_named(e, left.element); });
      if (kind == std::end(kLeftOut)) return false;
      if (kind->said != nullptr)
        for (const XMLElement* c = e.FirstChildElement(); c != nullptr; c = c->NextSiblingElement())
          ++count[kind->said];
      return true;
    });
    // They name assets, which are gone.
    for (const char* element : {"geom", "site", "spatial"})
      take_away(document_.root(), element, "material");
    for (XMLElement* d = document_.root().FirstChildElement("default"); d != nullptr;
         d = d->NextSiblingElement("default"))
      for (const char* asset : {"mesh", "hfield"}) take_away(*d, "geom", asset);
    std::vector<std::string> said;
    for (const auto& [what, many] : count) said.push_back(fmt::format("{} {}", many, what));
    if (!said.empty()) notes_.push_back(fmt::format("left out: {}", fmt::join(said, ", ")));
    if (unread_ > 0) notes_.push_back(unread());
  }

  /// Why bodies may weigh nothing; empty where they do not.
  [[nodiscard]] std::string unread() const {
    return unread_ == 0 ? ""
                        : fmt::format(
                              "{} shapes were left out whose mesh alone says what their "
                              "body weighs: put its file where the model names it, or "
                              "state the inertia of these bodies",
                              unread_);
  }

  /// A plant stands on the ground.
  void hold_base() {
    std::set<std::string> held;
    for (XMLElement* world = document_.root().FirstChildElement("worldbody"); world != nullptr;
         world = world->NextSiblingElement("worldbody"))
      prune(*world, [&](XMLElement& e) {
        if (!is_free_joint(document_, e)) return false;
        const char* name = e.Parent()->ToElement()->Attribute("name");
        notes_.push_back(fmt::format("{}: body {} floats in the model; here it is held",
                                     RobotDocument::where(e),
                                     name != nullptr ? name : "of a joint"));
        if (e.Attribute("name") != nullptr) held.insert(e.Attribute("name"));
        return true;
      });
    for (XMLElement* e : children_of_sections(document_, "actuator")) {
      const char* joint = e->Attribute("joint");
      if (joint == nullptr || !held.contains(joint)) continue;
      notes_.push_back(
          fmt::format("{}: an actuator of the held base is left out", RobotDocument::where(*e)));
      e->Parent()->DeleteChild(e);
    }
  }

  /// Removes what the library names as unknown; false where it names nothing of the kind, or what
  /// carries a part of the robot.
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

  /// What stands in a word that the library does not know and is a part of the robot; else empty.
  [[nodiscard]] const std::string& carried() const { return carried_; }

 private:
  /// Makes their folder an absolute one: the library gets no file to start from.
  std::set<std::string> readable_meshes() {
    const fs::path folder = mesh_folder(document_, path_);
    std::set<std::string> out;
    for (const XMLElement* e : children_of_sections(document_, "asset")) {
      const char* file = is_named(*e, "mesh") ? e->Attribute("file") : nullptr;
      std::error_code absent;
      if (file != nullptr && fs::is_regular_file(folder / file, absent)) out.insert(asset_name(*e));
    }
    for (XMLElement* c = document_.root().FirstChildElement("compiler"); c != nullptr;
         c = c->NextSiblingElement("compiler"))
      if (!out.empty()) c->SetAttribute("meshdir", folder.string().c_str());
    return out;
  }

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
        const bool is_it = name.empty()
                               ? a->Value() == value && std::string_view(a->Name()) != "name"
                               : a->Name() == name;
        if (is_it && name.empty() && std::string_view(a->Name()) == "type" &&
            (element == "joint" || element == "geom")) {
          carried_ = fmt::format("{}: type '{}' of <{}> is not known to the installed MuJoCo {}",
                                 RobotDocument::where(e), value, element, mj_versionString());
        } else if (is_it) {
          dropped = name.empty() ? fmt::format("{}=\"{}\"", a->Name(), value) : name;
          e.DeleteAttribute(a->Name());
        }
        a = next;
      }
      return false;
    });
    if (!dropped.empty()) note_unknown(fmt::format("{} of <{}>", dropped, element));
    return !dropped.empty() && carried_.empty();
  }

  bool drop_element(const std::string& element) {
    bool any = false;
    prune(document_.root(), [&](XMLElement& e) {
      if (!is_named(e, element) || !carried_.empty()) return false;
      if (const XMLElement* part = part_of_robot(e)) {
        carried_ = fmt::format(
            "{}: <{}> is not known to the installed MuJoCo {} and holds {}",
            RobotDocument::where(e), element, mj_versionString(),
            part == &e ? std::string("a part of the robot") : fmt::format("<{}>", part->Name()));
        return false;
      }
      return any = true;
    });
    if (any) note_unknown(fmt::format("<{}>", element));
    return any && carried_.empty();
  }

  RobotDocument& document_;
  const fs::path& path_;
  std::vector<std::string>& notes_;
  std::string carried_;
  std::size_t unread_ = 0;  ///< shapes that weigh, of meshes that are not there
};

/// The element of the document that stands in that line of its text.
const XMLElement* element_at(const RobotDocument& document, const std::string& text, int line) {
  tinyxml2::XMLDocument printed;
  if (printed.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) return nullptr;
  const XMLElement* found = nullptr;
  const std::function<void(const XMLElement&, const XMLElement&)> walk =
      [&](const XMLElement& own, const XMLElement& same) {
        if (same.GetLineNum() <= line) found = &own;
        const XMLElement* other = same.FirstChildElement();
        for (const XMLElement* e = own.FirstChildElement(); e != nullptr && other != nullptr;
             e = e->NextSiblingElement(), other = other->NextSiblingElement())
          walk(*e, *other);
      };
  walk(document.root(), *printed.RootElement());
  return found;
}

/// The library counts lines of the text that it was given.
std::string in_file(const RobotDocument& document, const std::string& text, std::string refusal,
                    const fs::path& path) {
  static const std::regex kLine("(, )?line( =)? (\\d+)(, column( =)? -?\\d+)?");
  std::smatch at;
  std::string place = path.string();
  if (std::regex_search(refusal, at, kLine)) {
    if (const XMLElement* e = element_at(document, text, std::stoi(at[3])))
      place = RobotDocument::where(*e);
    refusal = at.prefix().str() + at.suffix().str();
  }
  std::replace(refusal.begin(), refusal.end(), '\n', ' ');
  return fmt::format("{}: MuJoCo {} refuses it: {}", place, mj_versionString(), refusal);
}

}  // namespace

core::Result<RobotFile> compile_robot(RobotDocument& document, const fs::path& path) {
  RobotFile out;
  Repair repair(document, path, out.notes);
  ServoWords servos;
  EffortLimits effort_limits;
  if (document.is_urdf()) {
    RAVENCAL_ASSIGN_OR_RETURN(out.words, take_urdf_words(document, out.notes));
  } else {
    repair.take_ranges_for_limits();
    repair.hold_base();
    servos = ServoWords::take(document, out.notes);
    effort_limits = EffortLimits::take(document, out.notes);
  }
  repair.leave_out_shapes();
  CompiledModel result;
  std::string text;
  for (int pass = 0; pass < kMostRepairs; ++pass) {
    text = document.text();
    result = compile_model(text, document.is_urdf() ? "robot.urdf" : "robot.xml");
    if (result.model || !repair.without(result.refusal)) break;
  }
  if (!repair.carried().empty()) return core::data_error(repair.carried());
  if (!result.model) {
    const std::string why = repair.unread();
    return core::data_error(in_file(document, text, result.refusal, path) +
                            (why.empty() ? "" : "; " + why));
  }
  out.model = std::move(result.model);
  servos.apply(*out.model);
  out.words.effort_limit.merge(effort_limits.of(*out.model));
  if (document.is_urdf()) restore_urdf_inertias(document, *out.model, out.notes);
  return out;
}

core::Result<RobotFile> read_robot_file(const fs::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::unique_ptr<RobotDocument> document,
                            read_robot_document(path));
  return compile_robot(*document, path);
}

}  // namespace ravencal::physics
