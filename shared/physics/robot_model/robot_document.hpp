// SPDX-License-Identifier: Apache-2.0
//
// The XML of a robot model of others, and where its parts stand in it.
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::physics {

/// A model's file with the children of included files in the place of the elements that name them.
struct RobotDocument {
  tinyxml2::XMLDocument xml;
  int included = 0;  ///< files that were put in

  [[nodiscard]] tinyxml2::XMLElement& root() { return *xml.RootElement(); }
  [[nodiscard]] const tinyxml2::XMLElement& root() const { return *xml.RootElement(); }
  [[nodiscard]] bool is_urdf() const;
  [[nodiscard]] std::string text() const;
};

/// Errors: kIo; kData where a file is not XML, or includes itself.
core::Result<std::unique_ptr<RobotDocument>> read_robot_document(const std::filesystem::path& path);
/// Of a text that includes nothing; `path` stands in messages.
core::Result<std::unique_ptr<RobotDocument>> parse_robot_document(
    std::string_view text, const std::filesystem::path& path);

/// Bodies and joints of an MJCF document in the order in which the library numbers them, the world
/// first.
struct Tree {
  std::vector<tinyxml2::XMLElement*> bodies, joints;
};
Tree tree_of(RobotDocument& document);

/// Children of all MJCF sections of that name, in order.
std::vector<tinyxml2::XMLElement*> children_of_sections(RobotDocument& document,
                                                        const char* section);

bool is_named(const tinyxml2::XMLElement& element, std::string_view name);

}  // namespace ravencal::physics
