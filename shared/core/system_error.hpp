// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::core {

/// `PATH: doing: reason`, with the reason that errno gives. kIo.
inline Error system_error(const std::filesystem::path& path, std::string_view doing) {
  return io_error(fmt::format("{}: {}: {}", path.string(), doing, std::strerror(errno)));
}

}  // namespace ravencal::core
