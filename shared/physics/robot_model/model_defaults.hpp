// SPDX-License-Identifier: Apache-2.0
//
// What an element of an MJCF document says by its class.
#pragma once

#include <tinyxml2.h>

#include <initializer_list>

#include "physics/robot_model/robot_document.hpp"

namespace ravencal::physics {

class ModelDefaults {
 public:
  explicit ModelDefaults(const RobotDocument& document) : document_(document) {}

  /// The attribute of the element or, where it has none, that of the nearest class that has one
  /// under any of the `tags`, the last word of it; null: nobody says it. Classes of classes stand
  /// around them, the outermost in several sections.
  [[nodiscard]] const char* attribute(const tinyxml2::XMLElement& element,
                                      std::initializer_list<const char*> tags,
                                      const char* name) const;
  /// The same without the element's own.
  [[nodiscard]] const char* of_class(const tinyxml2::XMLElement& element,
                                     std::initializer_list<const char*> tags,
                                     const char* name) const;

 private:
  [[nodiscard]] const tinyxml2::XMLElement* class_of(const tinyxml2::XMLElement& element) const;
  [[nodiscard]] const tinyxml2::XMLElement* class_named(const char* name) const;

  const RobotDocument& document_;
};

}  // namespace ravencal::physics
