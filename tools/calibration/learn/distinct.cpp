// SPDX-License-Identifier: Apache-2.0
#include "learn/distinct.hpp"

#include <fmt/format.h>

#include <map>

#include "learn/file_hash.hpp"

namespace ravencal::learn {

core::Status check_distinct(std::span<const std::string> training,
                            std::span<const std::string> validation) {
  std::map<std::string, std::string> path_of_hash;
  const auto add = [&](std::span<const std::string> paths, const char* what) -> core::Status {
    for (const std::string& path : paths) {
      RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, sha256_of_file(path));
      const auto [other, is_new] = path_of_hash.emplace(hash, path);
      if (is_new) continue;
      return core::usage_error(
          fmt::format("{}: is given twice{}{}; give each recording once, and validate with "
                      "recordings that do not train",
                      path, what, other->second == path ? "" : ", as " + other->second));
    }
    return {};
  };
  RAVENCAL_RETURN_IF_ERROR(add(training, ""));
  return add(validation, ", for --validate as well");
}

}  // namespace ravencal::learn
