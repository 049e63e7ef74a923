// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/attach.hpp"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/model_names.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

constexpr int kMostAttached = 20;

XMLElement* find_below(XMLElement& around, std::string_view element, const char* name) {
  for (XMLElement* e = around.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const bool is_it =
        is_named(*e, element) && (name == nullptr || e->Attribute("name", name) != nullptr);
    if (is_it) return e;
    if (XMLElement* below = find_below(*e, element, name)) return below;
  }
  return nullptr;
}

/// Last word of the document on how angles are measured.
std::string angles_of(const RobotDocument& document, const char* attribute, const char* otherwise) {
  std::string out = otherwise;
  for (const XMLElement* c = document.root().FirstChildElement("compiler"); c != nullptr;
       c = c->NextSiblingElement("compiler"))
    if (const char* value = c->Attribute(attribute)) out = value;
  return out;
}

void prefix_attribute(XMLElement& element, const char* attribute, const std::string& prefix) {
  if (const char* value = element.Attribute(attribute))
    element.SetAttribute(attribute, (prefix + value).c_str());
}

/// Classes of all below the element.
void prefix_classes(XMLElement& around, const std::string& prefix) {
  for (XMLElement* e = around.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    prefix_attribute(*e, "class", prefix);
    prefix_attribute(*e, "childclass", prefix);
    prefix_classes(*e, prefix);
  }
}

class Attachment {
 public:
  Attachment(RobotDocument& document, XMLElement& element, RobotDocument& other)
      : document_(document),
        element_(element),
        other_(other),
        prefix_(text_of(element, "prefix")) {}

  static std::string text_of(const XMLElement& element, const char* attribute) {
    const char* text = element.Attribute(attribute);
    return text != nullptr ? text : "";
  }

  core::Status put_in() {
    for (const auto& [attribute, otherwise] :
         {std::pair{"angle", "degree"}, std::pair{"eulerseq", "xyz"}})
      if (angles_of(document_, attribute, otherwise) != angles_of(other_, attribute, otherwise))
        return error_at(element_, fmt::format("<attach> of a model with another {}: state the "
                                              "same one in both",
                                              attribute));
    // Without a body it is the other world that stands here.
    const bool is_world = element_.Attribute("body") == nullptr;
    XMLElement* body = is_world ? other_.root().FirstChildElement("worldbody")
                                : find_below(other_.root(), "body", element_.Attribute("body"));
    if (body == nullptr)
      return error_at(
          element_, fmt::format("<attach>: the model has no body '{}'", text_of(element_, "body")));
    RAVENCAL_RETURN_IF_ERROR(take_classes());
    ModelNames names = names_in(*body);
    add_own_name(*body, names);
    XMLElement* copy = document_.copy_of(*body);
    adopt(*copy, "childclass");
    rename(*copy, prefix_, "");
    prefix_attribute(*copy, "name", prefix_);
    if (is_world) copy->SetName("frame");
    element_.Parent()->InsertAfterChild(&element_, copy);
    element_.Parent()->DeleteChild(&element_);
    for (const char* section : {"tendon", "equality", "actuator"}) take_section(section, names);
    return {};
  }

 private:
  /// The element's classes are those of its own model, also where it names none.
  void adopt(XMLElement& element, const char* attribute) const {
    if (element.Attribute(attribute) == nullptr && has_defaults_)
      element.SetAttribute(attribute, "main");
    prefix_attribute(element, attribute, prefix_);
    prefix_classes(element, prefix_);
  }

  /// The other model's defaults become a class of this one, which must not add to them.
  core::Status take_classes() {
    std::vector<XMLElement*> own, others;
    for (XMLElement* d = document_.root().FirstChildElement("default"); d != nullptr;
         d = d->NextSiblingElement("default"))
      for (XMLElement* e = d->FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
        if (!is_named(*e, "default")) own.push_back(e);
    for (XMLElement* d = other_.root().FirstChildElement("default"); d != nullptr;
         d = d->NextSiblingElement("default"))
      for (XMLElement* e = d->FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
        others.push_back(e);
    if (!own.empty())
      return error_at(*own.front(),
                      "a model with defaults for all its elements attaches another "
                      "one: put them into a class");
    has_defaults_ = !others.empty();
    if (!has_defaults_) return {};
    XMLElement& around = child_of(document_, document_.root(), "default");
    const std::string main = prefix_ + "main";
    for (XMLElement* d = around.FirstChildElement("default"); d != nullptr;
         d = d->NextSiblingElement("default"))
      if (d->Attribute("class", main.c_str()) != nullptr) return {};  // attached before
    XMLElement* taken = document_.xml.NewElement("default");
    for (const XMLElement* e : others) {
      XMLElement* copy = document_.copy_of(*e);
      prefix_attribute(*copy, "class", prefix_);
      prefix_classes(*copy, prefix_);
      taken->InsertEndChild(copy);
    }
    taken->SetAttribute("class", main.c_str());
    around.InsertEndChild(taken);
    return {};
  }

  void take_section(const char* section, ModelNames& names) {
    for (const XMLElement* e : children_of_sections(other_, section)) {
      if (!refers_to(*e, names)) continue;
      if (std::string_view(section) == "tendon") add_own_name(*e, names);
      XMLElement* copy = document_.copy_of(*e);
      adopt(*copy, "class");
      rename_with_references(*copy, names, prefix_, "");
      child_of(document_, document_.root(), section).InsertEndChild(copy);
    }
  }

  RobotDocument& document_;
  XMLElement& element_;
  RobotDocument& other_;
  std::string prefix_;
  bool has_defaults_ = false;
};

/// File of a model that the document names.
core::Result<fs::path> file_of(RobotDocument& document, const XMLElement& attach,
                               const fs::path& path) {
  const std::string name = Attachment::text_of(attach, "model");
  for (XMLElement* e : children_of_sections(document, "asset")) {
    if (!is_named(*e, "model")) continue;
    const std::string file = Attachment::text_of(*e, "file");
    const std::string own = e->Attribute("name") != nullptr ? Attachment::text_of(*e, "name")
                                                            : fs::path(file).stem().string();
    if (own == name) return path.parent_path() / file;
  }
  return error_at(attach,
                  fmt::format("<attach> of '{}', which is no <model> among the assets", name));
}

}  // namespace

core::Status attach_models(RobotDocument& document, const fs::path& path, int depth) {
  int count = 0;
  for (XMLElement* e = find_below(document.root(), "attach", nullptr); e != nullptr;
       e = find_below(document.root(), "attach", nullptr)) {
    if (++count > kMostAttached || depth > kMostAttached)
      return error_at(*e, fmt::format("more than {} models are attached", kMostAttached));
    RAVENCAL_ASSIGN_OR_RETURN(const fs::path file, file_of(document, *e, path));
    RAVENCAL_ASSIGN_OR_RETURN(auto other, read_robot_document(file, depth + 1));
    RAVENCAL_RETURN_IF_ERROR(Attachment(document, *e, *other).put_in());
    document.attached.push_back(std::move(other));  // elements point at its places
  }
  return {};
}

}  // namespace ravencal::physics
