// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "quadrature_reader/sources/source.hpp"

namespace ravencal::quadrature_reader {

/// Encoder nodes on a SocketCAN interface.
std::unique_ptr<Source> make_can_source(const SourceSettings& settings);

}  // namespace ravencal::quadrature_reader
