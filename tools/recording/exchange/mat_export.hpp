// SPDX-License-Identifier: Apache-2.0
//
// A recording as a MAT-file of level 5, for MATLAB, Octave and SciPy; the layout is in
// shared/FORMATS.md.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

/// Values in SI units, lost ones NaN. Errors: kIo; kData: a matrix above the format's 2 GiB; then
/// `path` is as it was.
core::Status export_mat(const record::Recording& recording, const std::filesystem::path& path);

}  // namespace ravencal::exchange
