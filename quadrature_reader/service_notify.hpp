// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace ravencal::quadrature_reader {

/// Tells the service manager, if one started us with NOTIFY_SOCKET (sd_notify(3) protocol), e.g.
/// "READY=1", "WATCHDOG=1". Does nothing otherwise.
void notify_service_manager(std::string_view state);

}  // namespace ravencal::quadrature_reader
