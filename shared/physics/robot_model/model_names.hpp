// SPDX-License-Identifier: Apache-2.0
//
// Names of an MJCF document's parts and what refers to them.
#pragma once

#include <tinyxml2.h>

#include <cstddef>
#include <set>
#include <string>
#include <utility>

namespace ravencal::physics {

/// What a name stands for.
enum class Named { kBody, kJoint, kSite, kGeom, kTendon, kMesh };
using ModelNames = std::set<std::pair<Named, std::string>>;

/// Of all below the element.
ModelNames names_in(const tinyxml2::XMLElement& around);
/// Its own, if others may refer to it.
void add_own_name(const tinyxml2::XMLElement& element, ModelNames& names);
/// How often the element and those below it refer to one of the names, and to others.
struct References {
  std::size_t inside = 0, outside = 0;
};
References references_of(const tinyxml2::XMLElement& element, const ModelNames& names);

/// Names of all below the element, and what these say of the names.
void rename(tinyxml2::XMLElement& around, const ModelNames& names, const std::string& prefix,
            const std::string& suffix);
/// The element's own name, and what it and those below say of the names.
void rename_with_references(tinyxml2::XMLElement& element, const ModelNames& names,
                            const std::string& prefix, const std::string& suffix);

}  // namespace ravencal::physics
