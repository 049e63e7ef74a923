// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "core/result.hpp"
#include "plugin_host/plugin_library.hpp"

namespace ravencal::host {

/// True for a file that write_flight() wrote.
bool is_flight(const std::filesystem::path& path);

/// Writes the plugin's record of its last FAULT as CSV with a header in the form of the profile
/// `generic`, one line per tick, oldest first. Returns how many FAULTs there were; without one, no
/// file is written.
core::Result<std::uint64_t> write_flight(const plugin_host::Instance& plugin,
                                         const std::filesystem::path& path);

}  // namespace ravencal::host
