// SPDX-License-Identifier: Apache-2.0
//
// Paths within a proof's folder; private to prove/.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/result.hpp"
#include "core/whole_file.hpp"

namespace ravencal::prove {

using Json = nlohmann::ordered_json;

struct Workspace {
  std::filesystem::path root;

  [[nodiscard]] std::filesystem::path given(int number) const {
    return root / "given" / fmt::format("{:04}", number);
  }
  [[nodiscard]] std::filesystem::path sealed(int number) const {
    return root / "sealed" / fmt::format("{:04}.json", number);
  }
  [[nodiscard]] std::filesystem::path verdict(int number) const {
    return root / "verdicts" / fmt::format("{:04}.json", number);
  }
};

/// Errors: kIo, or kData if it is not JSON.
inline core::Result<Json> read_json(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_discarded()) return json;
  return core::Error{core::ErrorCode::kData, fmt::format("{}: is not JSON", path.string())};
}

}  // namespace ravencal::prove
