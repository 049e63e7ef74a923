// SPDX-License-Identifier: Apache-2.0
//
// HDF5 files in: the datasets of anybody's file, and recordings as hdf5_export.hpp writes them.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "exchange/named_array.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

/// Every dataset of every group; its name is its path without the leading slash. One that holds
/// neither numbers nor texts, or claims more values than its stored bytes can hold, is unreadable.
/// Errors: kIo; kData: no HDF5 file, or a damaged one.
core::Result<std::vector<NamedArray>> read_hdf5(const std::filesystem::path& path);

/// The recording that `ravencal export` wrote there; none if the file is somebody else's. Errors as
/// read_hdf5, and what of it is damaged.
core::Result<std::optional<record::Recording>> read_exported_hdf5(
    const std::filesystem::path& path);

}  // namespace ravencal::exchange
