// SPDX-License-Identifier: Apache-2.0
#include "core/temporary_folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

#include "core/outputs.hpp"
#include "core/whole_file.hpp"

namespace ravencal::core {

std::filesystem::path temporary_place() {
  std::error_code absent;
  std::filesystem::path place = std::filesystem::temp_directory_path(absent);
  return absent ? "/tmp" : place;
}

Result<TemporaryFolder> TemporaryFolder::create() {
  std::string name = (temporary_place() / "ravencal-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) return write_error(name, errno);
  add_scratch(name);
  return TemporaryFolder(name);
}

TemporaryFolder::TemporaryFolder(std::filesystem::path path)
    : path_(std::move(path)), unfinished_(path_) {}

TemporaryFolder::TemporaryFolder(TemporaryFolder&& other) noexcept
    : path_(std::exchange(other.path_, {})), unfinished_(std::move(other.unfinished_)) {}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

}  // namespace ravencal::core
