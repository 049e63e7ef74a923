// SPDX-License-Identifier: Apache-2.0
//
// The XML of a robot model of others, and where its parts stand in it.
#pragma once

#include <tinyxml2.h>

#include <deque>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::physics {

/// Where an element stands in the files.
struct Place {
  std::string file;
  int line = 0;
};

/// A model's file with the children of included files in the place of the elements that name them,
/// and without frames, replicas and attachments: their bodies stand where these put them.
struct RobotDocument {
  tinyxml2::XMLDocument xml;
  int included = 0;          ///< files that were put in
  std::deque<Place> places;  ///< of elements, which point at theirs by their user data
  std::vector<std::unique_ptr<RobotDocument>> attached{};  ///< whose elements stand in this one

  /// `FILE:LINE` of the element, or of the nearest one around it that stands in a file.
  [[nodiscard]] static std::string where(const tinyxml2::XMLElement& element);
  /// A copy with the places of the original.
  tinyxml2::XMLElement* copy_of(const tinyxml2::XMLElement& element);
  [[nodiscard]] tinyxml2::XMLElement& root() { return *xml.RootElement(); }
  [[nodiscard]] const tinyxml2::XMLElement& root() const { return *xml.RootElement(); }
  [[nodiscard]] bool is_urdf() const;
  [[nodiscard]] std::string text() const;
};

/// Errors: kIo; kData where a file is not XML, includes itself, is nested too deeply, or puts
/// together models in a way that cannot be followed.
/// `depth`: how many models this one is attached to.
core::Result<std::unique_ptr<RobotDocument>> read_robot_document(const std::filesystem::path& path,
                                                                 int depth = 0);
/// Of a text that includes nothing; `path` stands in messages.
core::Result<std::unique_ptr<RobotDocument>> parse_robot_document(
    std::string_view text, const std::filesystem::path& path);

/// Bodies and joints of an MJCF document in the order in which the library numbers them, the world
/// first. Joints of six degrees of freedom are none: a plant's base is held.
struct Tree {
  std::vector<tinyxml2::XMLElement*> bodies, joints;
};
Tree tree_of(RobotDocument& document);

/// Children of all MJCF sections of that name, in order.
std::vector<tinyxml2::XMLElement*> children_of_sections(RobotDocument& document,
                                                        const char* section);

bool is_named(const tinyxml2::XMLElement& element, std::string_view name);
/// What others call an asset: its name, or that of its file without folder and ending.
std::string asset_name(const tinyxml2::XMLElement& asset);
/// Where the MJCF document at `path` has its meshes.
std::filesystem::path mesh_folder(const RobotDocument& document, const std::filesystem::path& path);
/// kData at the element's place.
core::Error error_at(const tinyxml2::XMLElement& element, const std::string& what);
/// Removes the attribute from all elements of that name, also from classes.
void take_away(tinyxml2::XMLElement& around, std::string_view element, const char* attribute);
/// `freejoint`, or a joint of type free, be it by its class.
bool is_free_joint(const RobotDocument& document, const tinyxml2::XMLElement& element);
/// Last word of an MJCF document's `compiler` elements on this.
std::string compiler_word(const RobotDocument& document, const char* attribute,
                          const char* otherwise);

}  // namespace ravencal::physics
