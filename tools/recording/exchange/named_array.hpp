// SPDX-License-Identifier: Apache-2.0
//
// What the readers of NumPy, MATLAB and HDF5 files have in common: arrays by name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "record/table.hpp"

namespace ravencal::exchange {

/// Deflate, which compresses all these files, makes at most this of a byte (zlib's documentation):
/// an array that claims more is none.
inline constexpr std::uintmax_t kMostPerStoredByte = 1032;

struct NamedArray {
  std::string name;
  std::vector<std::size_t> shape{};  ///< empty: a single value
  bool is_column_major = false;      ///< the first index runs fastest
  std::vector<double> values{};
  std::vector<std::string> texts{};  ///< instead of values
  std::string unreadable{};          ///< why there are neither; else empty
};

/// Appends the array's columns: one called as the array, or NAME[0], NAME[1], ... of an array
/// [rows, k]. What can be no column goes into table.left_out with the reason.
void add_columns(record::Table& table, NamedArray array);

/// That there is such a file, and that it is not empty. Errors: kIo, kData.
core::Status check_is_there(const std::filesystem::path& path);

/// Refuses a name that two arrays have.
core::Status check_names(const record::Table& table);

}  // namespace ravencal::exchange
