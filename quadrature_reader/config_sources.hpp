// SPDX-License-Identifier: Apache-2.0
//
// The parts of the configuration that depend on the kind of source. Private to the configuration.
#pragma once

#include <cstdint>

#include "core/toml_table.hpp"
#include "quadrature_reader/config.hpp"

namespace ravencal::quadrature_reader {

/// The keys of one [[source]].
SourceSettings read_source_settings(core::TomlTable& table);

/// The keys of [[encoder]] number `axis_number` that say where its source finds it; added to
/// `source`.
void read_wiring(core::TomlTable& table, std::uint8_t axis_number, SourceSettings& source,
                 AxisSettings& axis);

}  // namespace ravencal::quadrature_reader
