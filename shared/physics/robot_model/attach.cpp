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

/// Words that decide what a document's numbers mean, and their value where nobody says them.
constexpr std::pair<const char*, const char*> kMeanings[] = {
    {"angle", "degree"},         {"eulerseq", "xyz"},    {"inertiafromgeom", "auto"},
    {"autolimits", "true"},      {"boundmass", "0"},     {"boundinertia", "0"},
    {"balanceinertia", "false"}, {"settotalmass", "-1"}, {"coordinate", "local"},
};

std::string attribute_text(const XMLElement& element, const char* attribute) {
  const char* text = element.Attribute(attribute);
  return text != nullptr ? text : "";
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
  /// `path`: of the other model.
  Attachment(RobotDocument& document, XMLElement& element, RobotDocument& other,
             const fs::path& path)
      : document_(document),
        element_(element),
        other_(other),
        path_(path),
        prefix_(attribute_text(element, "prefix")) {}

  core::Status put_in() {
    if (other_.is_urdf() || prefix_.empty())
      return error_at(element_, "<attach> wants an MJCF model and a prefix for its names");
    for (const auto& [attribute, otherwise] : kMeanings)
      if (compiler_word(document_, attribute, otherwise) !=
          compiler_word(other_, attribute, otherwise))
        return error_at(element_, fmt::format("<attach> of a model with another {}: state the "
                                              "same one in both",
                                              attribute));
    RAVENCAL_ASSIGN_OR_RETURN(XMLElement * copy, copy_of_body());
    ModelNames names = names_in(*copy);
    add_own_name(*copy, names);
    take_meshes(names);
    RAVENCAL_RETURN_IF_ERROR(take_classes(names));
    adopt(*copy, "childclass");
    rename(*copy, names, prefix_, "");
    prefix_attribute(*copy, "name", prefix_);
    element_.Parent()->InsertAfterChild(&element_, copy);
    element_.Parent()->DeleteChild(&element_);
    for (const char* section : {"tendon", "equality", "actuator"}) take_section(section, names);
    return {};
  }

 private:
  /// Without a body it is the other world that stands here.
  core::Result<XMLElement*> copy_of_body() {
    if (const char* name = element_.Attribute("body")) {
      const XMLElement* body = find_below(other_.root(), "body", name);
      if (body == nullptr)
        return error_at(element_, fmt::format("<attach>: the model has no body '{}'", name));
      return document_.copy_of(*body);
    }
    XMLElement* frame = document_.xml.NewElement("frame");
    for (const XMLElement* e : children_of_sections(other_, "worldbody"))
      frame->InsertEndChild(document_.copy_of(*e));
    return frame;
  }

  /// The element's classes are those of its own model, also where it names none.
  void adopt(XMLElement& element, const char* attribute) const {
    if (element.Attribute(attribute) == nullptr)
      element.SetAttribute(attribute, main_.c_str());
    else
      prefix_attribute(element, attribute, prefix_);
    prefix_classes(element, prefix_);
  }

  /// By absolute files: the other model's folder is not this one's.
  void take_meshes(ModelNames& names) {
    const fs::path folder = mesh_folder(other_, path_);
    for (const XMLElement* e : children_of_sections(other_, "asset")) {
      if (!is_named(*e, "mesh") || e->Attribute("file") == nullptr) continue;
      const std::string name = asset_name(*e);
      names.emplace(Named::kMesh, name);
      XMLElement* copy = document_.copy_of(*e);
      copy->SetAttribute("name", (prefix_ + name).c_str());
      copy->SetAttribute("file", (folder / attribute_text(*e, "file")).string().c_str());
      prefix_attribute(*copy, "class", prefix_);
      child_of(document_, document_.root(), "asset").InsertEndChild(copy);
    }
  }

  /// The other model's defaults become a class of this one, which must not add to them.
  core::Status take_classes(const ModelNames& names) {
    for (const XMLElement* e : children_of_sections(document_, "default"))
      if (!is_named(*e, "default"))
        return error_at(*e,
                        "a model with defaults for all its elements attaches another one: put "
                        "them into a class");
    const XMLElement* top = other_.root().FirstChildElement("default");
    main_ = prefix_ + (top != nullptr && top->Attribute("class") != nullptr
                           ? attribute_text(*top, "class")
                           : "main");
    XMLElement& around = child_of(document_, document_.root(), "default");
    for (const XMLElement* d : children_of_sections(document_, "default"))
      if (d->Attribute("class", main_.c_str()) != nullptr)
        return same_model(*d) ? core::Status()
                              : error_at(element_, fmt::format("<attach> of another model with "
                                                               "the prefix '{}'",
                                                               prefix_));
    XMLElement* taken = document_.xml.NewElement("default");
    taken->SetAttribute("class", main_.c_str());
    taken->SetUserData(other_.root().GetUserData());
    for (const XMLElement* e : children_of_sections(other_, "default")) {
      XMLElement* copy = document_.copy_of(*e);
      prefix_attribute(*copy, "class", prefix_);
      prefix_classes(*copy, prefix_);
      taken->InsertEndChild(copy);
    }
    rename(*taken, names, prefix_, "");
    around.InsertEndChild(taken);
    return {};
  }

  [[nodiscard]] bool same_model(const XMLElement& taken) const {
    const auto* place = static_cast<const Place*>(taken.GetUserData());
    const auto* own = static_cast<const Place*>(other_.root().GetUserData());
    return place != nullptr && own != nullptr && place->file == own->file;
  }

  /// What joins the attached part to the rest of its model stays there.
  void take_section(const char* section, ModelNames& names) {
    for (const XMLElement* e : children_of_sections(other_, section)) {
      const References references = references_of(*e, names);
      if (references.inside == 0 || references.outside > 0) continue;
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
  const fs::path& path_;
  std::string prefix_;
  std::string main_;  ///< the class of what names none
};

/// File of a model that the document names.
core::Result<fs::path> file_of(RobotDocument& document, const XMLElement& attach,
                               const fs::path& path) {
  const std::string name = attribute_text(attach, "model");
  for (XMLElement* e : children_of_sections(document, "asset")) {
    if (!is_named(*e, "model")) continue;
    const std::string file = attribute_text(*e, "file");
    if (file.empty()) return error_at(*e, "<model> names no file");
    if (asset_name(*e) == name) return path.parent_path() / file;
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
    const XMLElement* around = e->Parent()->ToElement();
    if (!is_named(*around, "worldbody") && !is_named(*around, "body") &&
        !is_named(*around, "frame") && !is_named(*around, "replicate"))
      return error_at(*e, fmt::format("<attach> stands in <{}>", around->Name()));
    RAVENCAL_ASSIGN_OR_RETURN(const fs::path file, file_of(document, *e, path));
    RAVENCAL_ASSIGN_OR_RETURN(auto other, read_robot_document(file, depth + 1));
    RAVENCAL_RETURN_IF_ERROR(Attachment(document, *e, *other, file).put_in());
    document.attached.push_back(std::move(other));  // elements point at its places
  }
  return {};
}

}  // namespace ravencal::physics
