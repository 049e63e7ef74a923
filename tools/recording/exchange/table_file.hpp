// SPDX-License-Identifier: Apache-2.0
//
// Foreign files of named columns, before a profile says which of them is which channel.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/table.hpp"

namespace ravencal::exchange {

/// True if read_table reads a file of that name: .csv, .npz, .npy, .mat, .h5, .hdf5, .mcap, .db3.
bool is_table(const std::filesystem::path& path);
/// These endings.
std::vector<std::string> table_extensions();

/// Every column of a foreign file, in the file's units: a CSV's columns; arrays of NumPy, MATLAB
/// and HDF5, where an array [rows, k] is k columns NAME[0] .. NAME[k-1], and one of one dimension,
/// [rows, 1] or [1, rows] is one column NAME; TOPIC/JOINT/position, velocity and effort of a bag of
/// ROS 2 and what controllers publish (FORMATS.md), with stamps beside them. What can be no column
/// stands in Table::left_out with the reason. Uses `skip_bad` and `threads` of the options, no
/// profile. Errors: kUsage (no such kind of file), kIo, kData (a damaged file; a row or message
/// that cannot be read, without skip_bad).
core::Result<record::Table> read_table(const std::filesystem::path& path,
                                       const record::LoadOptions& options = {});

}  // namespace ravencal::exchange
