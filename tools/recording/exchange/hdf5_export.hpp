// SPDX-License-Identifier: Apache-2.0
//
// A recording as an HDF5 file for Python, MATLAB and Julia; the layout is in shared/FORMATS.md.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

/// Values in SI units, lost ones NaN. Errors: kIo; then `path` is as it was.
core::Status export_hdf5(const record::Recording& recording, const std::filesystem::path& path);

}  // namespace ravencal::exchange
