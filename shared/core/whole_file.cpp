// SPDX-License-Identifier: Apache-2.0
#include "core/whole_file.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "core/write_all.hpp"

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
  RAVENCAL_ASSIGN_OR_RETURN(PartialFile target, PartialFile::create(path));
  if (!write_all(target.descriptor(), bytes)) return write_error(path, errno);
  return target.publish();
}

bool write_all(int file, std::string_view bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno == EAGAIN) {  // another process made this terminal or pipe non-blocking
      pollfd room = {file, POLLOUT, 0};
      (void)::poll(&room, 1, -1);
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

Error write_error(const std::filesystem::path& path, int reason) {
  return {ErrorCode::kIo,
          fmt::format("{}: cannot be written: {}; choose a folder that exists, is writable and has "
                      "room",
                      path.string(), std::strerror(reason))};
}

}  // namespace ravencal::core
