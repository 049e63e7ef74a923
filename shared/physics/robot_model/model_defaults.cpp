// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/model_defaults.hpp"

#include <string_view>

namespace ravencal::physics {
namespace {

using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

const XMLElement* find_class(const XMLElement& around, std::string_view name) {
  for (const XMLElement* e = around.FirstChildElement("default"); e != nullptr;
       e = e->NextSiblingElement("default")) {
    if (e->Attribute("class") != nullptr && e->Attribute("class") == name) return e;
    if (const XMLElement* inner = find_class(*e, name)) return inner;
  }
  return nullptr;
}

}  // namespace

const XMLElement* ModelDefaults::class_named(const char* name) const {
  return find_class(document_.root(), name);
}

const XMLElement* ModelDefaults::class_of(const XMLElement& element) const {
  if (const char* own = element.Attribute("class")) return class_named(own);
  for (const XMLNode* n = element.Parent(); n != nullptr && n->ToElement() != nullptr;
       n = n->Parent())
    if (const char* around = n->ToElement()->Attribute("childclass")) return class_named(around);
  return document_.root().FirstChildElement("default");
}

const char* ModelDefaults::attribute(const XMLElement& element,
                                     std::initializer_list<const char*> tags,
                                     const char* name) const {
  const char* own = element.Attribute(name);
  return own != nullptr ? own : of_class(element, tags, name);
}

const char* ModelDefaults::of_class(const XMLElement& element,
                                    std::initializer_list<const char*> tags,
                                    const char* name) const {
  const auto last_word = [&](const XMLElement& section) {
    const char* found = nullptr;
    for (const XMLElement* e = section.FirstChildElement(); e != nullptr;
         e = e->NextSiblingElement())
      for (const char* tag : tags)
        if (is_named(*e, tag) && e->Attribute(name) != nullptr) found = e->Attribute(name);
    return found;
  };
  const XMLElement* c = class_of(element);
  for (; c != nullptr && c->Parent()->ToElement() != &document_.root();
       c = c->Parent()->ToElement())
    if (const char* value = last_word(*c)) return value;
  const char* found = nullptr;
  for (const XMLElement* d = document_.root().FirstChildElement("default"); d != nullptr;
       d = d->NextSiblingElement("default"))
    if (const char* value = last_word(*d)) found = value;
  return found;
}

}  // namespace ravencal::physics
