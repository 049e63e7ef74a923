// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/model_names.hpp"

#include <optional>

#include "physics/robot_model/robot_document.hpp"

namespace ravencal::physics {
namespace {

using tinyxml2::XMLElement;

std::optional<Named> named_kind(const XMLElement& element) {
  if (is_named(element, "body")) return Named::kBody;
  if (is_named(element, "joint")) return Named::kJoint;
  if (is_named(element, "site")) return Named::kSite;
  if (is_named(element, "geom")) return Named::kGeom;
  if (is_named(element, "fixed") || is_named(element, "spatial")) return Named::kTendon;
  return std::nullopt;
}

constexpr std::pair<const char*, Named> kReferences[] = {
    {"body", Named::kBody},           {"body1", Named::kBody},    {"body2", Named::kBody},
    {"joint", Named::kJoint},         {"joint1", Named::kJoint},  {"joint2", Named::kJoint},
    {"jointinparent", Named::kJoint}, {"site", Named::kSite},     {"site1", Named::kSite},
    {"site2", Named::kSite},          {"refsite", Named::kSite},  {"cranksite", Named::kSite},
    {"slidersite", Named::kSite},     {"sidesite", Named::kSite}, {"geom", Named::kGeom},
    {"geom1", Named::kGeom},          {"geom2", Named::kGeom},    {"tendon", Named::kTendon},
    {"target", Named::kBody},         {"mesh", Named::kMesh},     {"tendon1", Named::kTendon},
    {"tendon2", Named::kTendon},
};

void extend(XMLElement& element, const char* attribute, const std::string& prefix,
            const std::string& suffix) {
  if (const char* name = element.Attribute(attribute))
    element.SetAttribute(attribute, (prefix + name + suffix).c_str());
}

/// Of all below the element.
void extend_names(XMLElement& around, const std::string& prefix, const std::string& suffix) {
  for (XMLElement* e = around.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    extend(*e, "name", prefix, suffix);
    extend_names(*e, prefix, suffix);
  }
}

void collect_names(const XMLElement& around, ModelNames& names) {
  for (const XMLElement* e = around.FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    add_own_name(*e, names);
    collect_names(*e, names);
  }
}

bool is_reference(const XMLElement& element, const char* attribute, Named kind,
                  const ModelNames& names) {
  const char* name = element.Attribute(attribute);
  return name != nullptr && names.contains({kind, name});
}

void follow(XMLElement& element, const ModelNames& names, const std::string& prefix,
            const std::string& suffix) {
  for (const auto& [attribute, kind] : kReferences)
    if (is_reference(element, attribute, kind, names)) extend(element, attribute, prefix, suffix);
  for (XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
    follow(*e, names, prefix, suffix);
}

}  // namespace

ModelNames names_in(const XMLElement& around) {
  ModelNames names;
  collect_names(around, names);
  return names;
}

void add_own_name(const XMLElement& element, ModelNames& names) {
  const std::optional<Named> kind = named_kind(element);
  if (kind && element.Attribute("name") != nullptr) names.emplace(*kind, element.Attribute("name"));
}

References references_of(const XMLElement& element, const ModelNames& names) {
  References out;
  for (const auto& [attribute, kind] : kReferences)
    if (element.Attribute(attribute) != nullptr)
      ++(is_reference(element, attribute, kind, names) ? out.inside : out.outside);
  for (const XMLElement* e = element.FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    const References below = references_of(*e, names);
    out.inside += below.inside;
    out.outside += below.outside;
  }
  return out;
}

void rename(XMLElement& around, const ModelNames& names, const std::string& prefix,
            const std::string& suffix) {
  extend_names(around, prefix, suffix);
  follow(around, names, prefix, suffix);
}

void rename_with_references(XMLElement& element, const ModelNames& names, const std::string& prefix,
                            const std::string& suffix) {
  extend(element, "name", prefix, suffix);
  follow(element, names, prefix, suffix);
}

}  // namespace ravencal::physics
