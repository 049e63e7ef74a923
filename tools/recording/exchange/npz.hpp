// SPDX-License-Identifier: Apache-2.0
//
// Reads what numpy.savez and numpy.save write.
#pragma once

#include <filesystem>
#include <vector>

#include "core/result.hpp"
#include "exchange/named_array.hpp"

namespace ravencal::exchange {

/// The arrays of a .npz in its order. One that holds neither float16 to float64, whole numbers,
/// booleans nor ASCII texts, or comes from a big-endian machine, is unreadable. Errors: kIo; kData:
/// no zip archive, a damaged one, an array that is cut short.
core::Result<std::vector<NamedArray>> read_npz(const std::filesystem::path& path);

/// The array of a .npy, without a name.
core::Result<NamedArray> read_npy(const std::filesystem::path& path);

}  // namespace ravencal::exchange
