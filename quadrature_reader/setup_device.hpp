// SPDX-License-Identifier: Apache-2.0
//
// --check-setup's look at the system: rights, device files, CAN interfaces. Each finding in words,
// with the remedy where something is wrong.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "quadrature_reader/setup_check.hpp"
#include "quadrature_reader/sources/can_link.hpp"

namespace ravencal::quadrature_reader {

/// Real-time scheduling and locked memory, for --realtime-priority.
std::vector<SetupFinding> realtime_findings();

/// A device file that the program must open: there, group, mode, whether this user may.
SetupFinding device_file_finding(const std::filesystem::path& path);

/// What the kernel says of a CAN interface, judged.
std::vector<SetupFinding> can_findings(const std::string& interface, const CanLink& link);

/// True if one of them is kBad.
bool any_bad(const std::vector<SetupFinding>& findings);

}  // namespace ravencal::quadrature_reader
