// SPDX-License-Identifier: Apache-2.0
#include "learn/whole_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace ravencal::learn {

core::Status write_whole_file(const std::filesystem::path& path, std::string_view bytes) {
  const std::filesystem::path partial = path.string() + ".partial";
  const auto failed = [&](const char* what, int reason) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: {}: {}", path.string(), what, std::strerror(reason))};
  };
  std::ofstream file(partial, std::ios::binary | std::ios::trunc);
  if (!file) return failed("cannot be created", errno);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) return failed("cannot be written", errno);
  std::error_code error;
  std::filesystem::rename(partial, path, error);
  if (error) return failed("cannot be replaced", error.value());
  return {};
}

}  // namespace ravencal::learn
