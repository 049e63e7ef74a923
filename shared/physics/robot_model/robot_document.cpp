// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/robot_document.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/whole_file.hpp"
#include "physics/robot_model/attach.hpp"
#include "physics/robot_model/frames.hpp"
#include "physics/robot_model/model_defaults.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

constexpr int kMostIncludes = 100;
/// Chains of bodies are shorter by far; libraries walk them by recursion.
constexpr int kMostDepth = 400;

/// A pipe or a device has no end.
core::Result<std::string> read_model(const fs::path& path) {
  if (std::error_code absent; fs::exists(path, absent) && !fs::is_regular_file(path, absent))
    return core::data_error(fmt::format("{}: is no file", path.string()));
  return core::read_whole_file(path);
}

core::Status too_deep(const fs::path& path) {
  return core::data_error(
      fmt::format("{}: elements are nested deeper than {}", path.string(), kMostDepth));
}

/// Notes where the element and those below stand.
core::Status note_places(RobotDocument& document, XMLElement& element, const fs::path& path,
                         int depth) {
  if (depth > kMostDepth) return too_deep(path);
  element.SetUserData(&document.places.emplace_back(Place{path.string(), element.GetLineNum()}));
  for (XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
    RAVENCAL_RETURN_IF_ERROR(note_places(document, *e, path, depth + 1));
  return {};
}

core::Status parse(RobotDocument& document, tinyxml2::XMLDocument& xml, std::string_view text,
                   const fs::path& path) {
  if (xml.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    return core::data_error(fmt::format("{}:{}: is not XML: {}", path.string(),
                                        std::max(1, xml.ErrorLineNum()), xml.ErrorName()));
  if (xml.RootElement() == nullptr)
    return core::data_error(fmt::format("{}: is empty", path.string()));
  if (const XMLElement* second = xml.RootElement()->NextSiblingElement())
    return core::data_error(fmt::format("{}:{}: <{}> stands beside the robot's own element",
                                        path.string(), second->GetLineNum(), second->Name()));
  return note_places(document, *xml.RootElement(), path, 0);
}

/// Puts the children of included files in the place of the elements that name them.
core::Status include_files(RobotDocument& document, XMLElement& parent, const fs::path& path,
                           int depth) {
  if (depth > kMostDepth) return too_deep(path);
  for (XMLElement* child = parent.FirstChildElement(); child != nullptr;) {
    XMLElement* next = child->NextSiblingElement();
    const char* file = is_named(*child, "include") ? child->Attribute("file") : nullptr;
    if (file == nullptr) {
      RAVENCAL_RETURN_IF_ERROR(include_files(document, *child, path, depth + 1));
      child = next;
      continue;
    }
    if (++document.included > kMostIncludes)
      return core::data_error(
          fmt::format("{}: includes itself, or more than {} files", path.string(), kMostIncludes));
    const fs::path other = path.parent_path() / file;
    RAVENCAL_ASSIGN_OR_RETURN(const std::string text, read_model(other));
    tinyxml2::XMLDocument included;
    RAVENCAL_RETURN_IF_ERROR(parse(document, included, text, other));
    XMLNode* before = child;
    for (const XMLNode* n = included.RootElement()->FirstChild(); n != nullptr;
         n = n->NextSibling()) {
      const XMLElement* e = n->ToElement();
      before = parent.InsertAfterChild(
          before, e != nullptr ? document.copy_of(*e) : n->DeepClone(&document.xml));
    }
    next = child->NextSiblingElement();
    parent.DeleteChild(child);
    child = next;
  }
  return {};
}

void copy_places(const XMLElement& from, XMLElement& to) {
  to.SetUserData(from.GetUserData());
  const XMLElement* other = from.FirstChildElement();
  for (XMLElement* e = to.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    copy_places(*other, *e);
    other = other->NextSiblingElement();
  }
}

void add_bodies(const RobotDocument& document, XMLElement& body, Tree& tree) {
  tree.bodies.push_back(&body);
  for (XMLElement* e = body.FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
    if (is_named(*e, "joint") && !is_free_joint(document, *e)) tree.joints.push_back(e);
  for (XMLElement* e = body.FirstChildElement("body"); e != nullptr;
       e = e->NextSiblingElement("body"))
    add_bodies(document, *e, tree);
}

}  // namespace

bool is_named(const XMLElement& element, std::string_view name) { return element.Name() == name; }

core::Error error_at(const XMLElement& element, const std::string& what) {
  return core::data_error(fmt::format("{}: {}", RobotDocument::where(element), what));
}

void take_away(XMLElement& around, std::string_view element, const char* attribute) {
  for (XMLElement* e = around.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (is_named(*e, element)) e->DeleteAttribute(attribute);
    take_away(*e, element, attribute);
  }
}

bool is_free_joint(const RobotDocument& document, const XMLElement& element) {
  if (is_named(element, "freejoint")) return true;
  if (!is_named(element, "joint")) return false;
  const char* type = ModelDefaults(document).attribute(element, {"joint"}, "type");
  return type != nullptr && std::string_view(type) == "free";
}

std::string compiler_word(const RobotDocument& document, const char* attribute,
                          const char* otherwise) {
  std::string out = otherwise;
  for (const XMLElement* c = document.root().FirstChildElement("compiler"); c != nullptr;
       c = c->NextSiblingElement("compiler"))
    if (const char* value = c->Attribute(attribute)) out = value;
  return out;
}

std::string asset_name(const XMLElement& asset) {
  if (const char* name = asset.Attribute("name")) return name;
  const char* file = asset.Attribute("file");
  return file != nullptr ? fs::path(file).stem().string() : "";
}

fs::path mesh_folder(const RobotDocument& document, const fs::path& path) {
  const std::string of_assets = compiler_word(document, "assetdir", "");
  return fs::absolute(path).parent_path() / compiler_word(document, "meshdir", of_assets.c_str());
}

std::string RobotDocument::where(const XMLElement& element) {
  for (const XMLNode* n = &element; n != nullptr; n = n->Parent())
    if (const auto* place = static_cast<const Place*>(n->GetUserData()))
      return fmt::format("{}:{}", place->file, place->line);
  return {};
}

XMLElement* RobotDocument::copy_of(const XMLElement& element) {
  XMLElement* copy = element.DeepClone(&xml)->ToElement();
  copy_places(element, *copy);
  return copy;
}

bool RobotDocument::is_urdf() const { return is_named(root(), "robot"); }

std::string RobotDocument::text() const {
  tinyxml2::XMLPrinter printer;
  xml.Print(&printer);
  return printer.CStr();
}

core::Result<std::unique_ptr<RobotDocument>> parse_robot_document(std::string_view text,
                                                                  const fs::path& path) {
  auto document = std::make_unique<RobotDocument>();
  RAVENCAL_RETURN_IF_ERROR(parse(*document, document->xml, text, path));
  return document;
}

core::Result<std::unique_ptr<RobotDocument>> read_robot_document(const fs::path& path, int depth) {
  if (path.extension() == ".xacro")
    return core::data_error(fmt::format("{}: is xacro: `xacro {} > robot.urdf` writes the robot",
                                        path.string(), path.filename().string()));
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, read_model(path));
  RAVENCAL_ASSIGN_OR_RETURN(std::unique_ptr<RobotDocument> document,
                            parse_robot_document(text, path));
  RAVENCAL_RETURN_IF_ERROR(include_files(*document, document->root(), path, 0));
  if (document->is_urdf()) return document;
  RAVENCAL_RETURN_IF_ERROR(attach_models(*document, path, depth));
  RAVENCAL_RETURN_IF_ERROR(put_in_place(*document));
  return document;
}

Tree tree_of(RobotDocument& document) {
  Tree tree;
  for (XMLElement* world = document.root().FirstChildElement("worldbody"); world != nullptr;
       world = world->NextSiblingElement("worldbody")) {
    const bool again = !tree.bodies.empty();
    add_bodies(document, *world, tree);
    if (again) tree.bodies.erase(std::find(tree.bodies.begin(), tree.bodies.end(), world));
  }
  return tree;
}

std::vector<XMLElement*> children_of_sections(RobotDocument& document, const char* section) {
  std::vector<XMLElement*> children;
  for (XMLElement* s = document.root().FirstChildElement(section); s != nullptr;
       s = s->NextSiblingElement(section))
    for (XMLElement* e = s->FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
      children.push_back(e);
  return children;
}

}  // namespace ravencal::physics
