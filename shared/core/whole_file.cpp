// SPDX-License-Identifier: Apache-2.0
#include "core/whole_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

namespace ravencal::core {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

Error read_error(const std::filesystem::path& path, int reason) {
  return {ErrorCode::kIo,
          fmt::format("{}: cannot be read: {}", path.string(), std::strerror(reason))};
}

}  // namespace

Result<std::string> read_whole_file(const std::filesystem::path& path) {
  const File file(std::fopen(path.c_str(), "rbe"));
  if (!file) return read_error(path, errno);
  std::string text;
  std::array<char, 65536> buffer{};
  std::size_t count = 0;
  while ((count = std::fread(buffer.data(), 1, buffer.size(), file.get())) > 0) {
    text.append(buffer.data(), count);
  }
  if (std::ferror(file.get()) != 0) return read_error(path, errno);
  return text;
}

Status write_whole_file(const std::filesystem::path& path, std::string_view bytes) {
  PartialFile target(path);
  const File file(std::fopen(target.partial().c_str(), "wbe"));
  if (!file) return write_error(path, errno);
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size() &&
                       std::fflush(file.get()) == 0 && fsync(fileno(file.get())) == 0;
  if (!written) return write_error(path, errno);
  return target.publish();
}

PartialFile::PartialFile(std::filesystem::path path)
    : path_(std::move(path)), partial_(path_.string() + ".partial") {}

PartialFile::~PartialFile() {
  if (partial_.empty()) return;
  std::error_code ignored;
  std::filesystem::remove(partial_, ignored);
}

Status PartialFile::publish() {
  std::error_code error;
  std::filesystem::rename(partial_, path_, error);
  if (error) return write_error(path_, error.value());
  partial_.clear();
  return {};
}

Error write_error(const std::filesystem::path& path, int reason) {
  return {ErrorCode::kIo,
          fmt::format("{}: cannot be written: {}; choose a folder that exists, is writable and has "
                      "room",
                      path.string(), std::strerror(reason))};
}

}  // namespace ravencal::core
