// SPDX-License-Identifier: Apache-2.0
//
// From bound columns to a recording. Private to record/.
#pragma once

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/profile.hpp"
#include "record/recording.hpp"
#include "record/table_source.hpp"

namespace ravencal::record {

/// Reads a source through a profile. Uses `skip_bad` of the options.
core::Result<Recording> load_source(const TableSource& source, Profile profile,
                                    const LoadOptions& options);

}  // namespace ravencal::record
