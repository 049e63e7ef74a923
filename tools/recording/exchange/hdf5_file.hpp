// SPDX-License-Identifier: Apache-2.0
//
// Datasets and attributes of a file that may lie about their sizes. Private to exchange/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "exchange/hdf5_handle.hpp"
#include "exchange/named_array.hpp"

namespace ravencal::exchange {

class Hdf5File {
 public:
  /// Errors: kIo (it cannot be read), kData (it is no HDF5 file).
  static core::Result<Hdf5File> open(const std::filesystem::path& path);

  /// Paths of all datasets, without the leading slash, in the order of their names. None: the
  /// file's tables are damaged.
  [[nodiscard]] std::optional<std::vector<std::string>> datasets() const;
  /// True if something has that name.
  [[nodiscard]] bool has(const std::string& name) const;
  /// Numbers or texts, or why there are none.
  [[nodiscard]] NamedArray array(const std::string& name) const;
  /// A vector of whole numbers, exact; none: it is something else.
  [[nodiscard]] std::optional<std::vector<std::int64_t>> integers(const std::string& name) const;
  /// Texts of all attributes of an object ("/" is the file); those of other types are left out.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> attributes(
      const std::string& name) const;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  Hdf5File(std::filesystem::path path, Hdf5Handle file, std::uintmax_t bytes)
      : path_(std::move(path)), file_(std::move(file)), bytes_(bytes) {}
  /// Values of a dataset, or none if its stored bytes cannot hold as many.
  [[nodiscard]] std::optional<std::size_t> count_of(hid_t set,
                                                    const std::vector<std::size_t>& shape) const;

  std::filesystem::path path_;
  Hdf5Handle file_;
  std::uintmax_t bytes_;
};

}  // namespace ravencal::exchange
