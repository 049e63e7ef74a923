// SPDX-License-Identifier: Apache-2.0
#include "learn/distinct.hpp"

#include <fmt/format.h>

#include <algorithm>
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

core::Result<std::vector<HashedFile>> hashed(const std::vector<std::string>& paths) {
  std::vector<HashedFile> files;
  for (const std::string& path : paths) {
    RAVENCAL_ASSIGN_OR_RETURN(std::string hash, sha256_of_file(path));
    files.push_back({path, std::move(hash)});
  }
  return files;
}

core::Status check_unseen(std::span<const HashedFile> training,
                          std::span<const HashedFile> tested) {
  for (const HashedFile& test : tested) {
    const auto seen = std::find_if(training.begin(), training.end(), [&](const HashedFile& file) {
      return file.sha256 == test.sha256;
    });
    if (seen == training.end()) continue;
    return core::data_error(
        fmt::format("{}: is both trained on and tested on{}; test on another recording", test.path,
                    seen->path == test.path ? "" : ", with the same bytes as " + seen->path));
  }
  return {};
}

}  // namespace ravencal::learn
