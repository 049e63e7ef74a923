// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/robot_document.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/whole_file.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

constexpr int kMostIncludes = 100;

/// Puts the children of included files in the place of the elements that name them.
core::Status include_files(RobotDocument& document, XMLElement& parent, const fs::path& path) {
  for (XMLElement* child = parent.FirstChildElement(); child != nullptr;) {
    XMLElement* next = child->NextSiblingElement();
    const char* file = is_named(*child, "include") ? child->Attribute("file") : nullptr;
    if (file == nullptr) {
      RAVENCAL_RETURN_IF_ERROR(include_files(document, *child, path));
      child = next;
      continue;
    }
    if (++document.included > kMostIncludes)
      return core::data_error(fmt::format("{}: includes itself", path.string()));
    const fs::path other = path.parent_path() / file;
    RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(other));
    tinyxml2::XMLDocument included;
    if (included.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS ||
        included.RootElement() == nullptr)
      return core::data_error(fmt::format("{}: is not XML", other.string()));
    XMLNode* before = child;
    for (XMLNode* n = included.RootElement()->FirstChild(); n != nullptr; n = n->NextSibling())
      before = parent.InsertAfterChild(before, n->DeepClone(&document.xml));
    next = child->NextSiblingElement();
    parent.DeleteChild(child);
    child = next;
  }
  return {};
}

void add_bodies(XMLElement& body, Tree& tree) {
  tree.bodies.push_back(&body);
  for (XMLElement* e = body.FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
    if (is_named(*e, "joint") || is_named(*e, "freejoint")) tree.joints.push_back(e);
  for (XMLElement* e = body.FirstChildElement("body"); e != nullptr;
       e = e->NextSiblingElement("body"))
    add_bodies(*e, tree);
}

}  // namespace

bool is_named(const XMLElement& element, std::string_view name) { return element.Name() == name; }

bool RobotDocument::is_urdf() const { return is_named(root(), "robot"); }

std::string RobotDocument::text() const {
  tinyxml2::XMLPrinter printer;
  xml.Print(&printer);
  return printer.CStr();
}

core::Result<std::unique_ptr<RobotDocument>> parse_robot_document(std::string_view text,
                                                                  const fs::path& path) {
  auto document = std::make_unique<RobotDocument>();
  if (document->xml.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    return core::data_error(fmt::format("{}:{}: is not XML: {}", path.string(),
                                        document->xml.ErrorLineNum(), document->xml.ErrorName()));
  if (document->xml.RootElement() == nullptr)
    return core::data_error(fmt::format("{}: is empty", path.string()));
  return document;
}

core::Result<std::unique_ptr<RobotDocument>> read_robot_document(const fs::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  RAVENCAL_ASSIGN_OR_RETURN(std::unique_ptr<RobotDocument> document,
                            parse_robot_document(text, path));
  RAVENCAL_RETURN_IF_ERROR(include_files(*document, document->root(), path));
  return document;
}

Tree tree_of(RobotDocument& document) {
  Tree tree;
  for (XMLElement* world = document.root().FirstChildElement("worldbody"); world != nullptr;
       world = world->NextSiblingElement("worldbody")) {
    const bool again = !tree.bodies.empty();
    add_bodies(*world, tree);
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
