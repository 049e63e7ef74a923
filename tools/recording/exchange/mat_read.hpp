// SPDX-License-Identifier: Apache-2.0
//
// MAT-files in (level 5, and 7.3, which is HDF5): anybody's variables, and recordings as
// mat_export.hpp writes them.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "exchange/named_array.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

/// Every numeric or logical matrix, and every cell vector of texts; those in structs are called
/// STRUCT.FIELD. What holds something else is unreadable. Errors: kIo; kData: no MAT-file.
core::Result<std::vector<NamedArray>> read_mat(const std::filesystem::path& path);

/// The recording that `ravencal export` wrote there; none if the file is somebody else's. Errors as
/// read_mat, and what of it is damaged.
core::Result<std::optional<record::Recording>> read_exported_mat(const std::filesystem::path& path);

}  // namespace ravencal::exchange
