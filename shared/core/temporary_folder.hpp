// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/outputs.hpp"
#include "core/result.hpp"

namespace ravencal::core {

/// The system's folder for temporary files.
std::filesystem::path temporary_place();

/// A new empty folder below the system's one for temporary files, which nobody else may enter. It
/// goes with this object, with what is in it.
class TemporaryFolder {
 public:
  /// Errors: kIo.
  static Result<TemporaryFolder> create();
  TemporaryFolder(TemporaryFolder&& other) noexcept;
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  explicit TemporaryFolder(std::filesystem::path path);

  std::filesystem::path path_;
  Unfinished unfinished_;
};

}  // namespace ravencal::core
