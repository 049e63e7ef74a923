// SPDX-License-Identifier: Apache-2.0
//
// The GPIO backend of this build: gpiod_v1.cpp or gpiod_v2.cpp, chosen by CMake.
#pragma once

#include <memory>
#include <string_view>

#include "quadrature_reader/sources/source.hpp"

namespace ravencal::quadrature_reader {

std::unique_ptr<Source> make_gpio_source(const SourceSettings& settings);

/// "libgpiod 1" or "libgpiod 2".
std::string_view gpio_library();

}  // namespace ravencal::quadrature_reader
