// SPDX-License-Identifier: Apache-2.0
//
// Reads what numpy.savez writes: vectors of numbers or of texts, by name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::conversion {

/// Lists by name; a single value is a list of one.
struct NamedLists {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::vector<std::string>> texts;
};

/// Errors (kIo, kData): no such file, no zip, an array of another kind or of several rows and
/// columns, a value that is not ASCII text.
core::Result<NamedLists> read_npz(const std::string& path);

}  // namespace ravencal::conversion
