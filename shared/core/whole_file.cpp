// SPDX-License-Identifier: Apache-2.0
#include "core/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <random>
#include <system_error>
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

/// What the path leads to, through links; the path itself where nothing is there yet.
std::filesystem::path target_of(const std::filesystem::path& path) {
  std::error_code absent;
  std::filesystem::path target = std::filesystem::canonical(path, absent);
  return absent ? path : target;
}

/// rename(2) that fails with EEXIST where the new name is taken.
bool give_new_name(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL) return false;
  // This file system cannot; most that cannot have links.
  return ::link(from.c_str(), to.c_str()) == 0 && ::unlink(from.c_str()) == 0;
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
  File file(std::fopen(target.partial().c_str(), "wbe"));
  if (!file) return write_error(path, errno);
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
  if (!written || std::fclose(file.release()) != 0) return write_error(path, errno);
  return target.publish();
}

PartialFile::PartialFile(const std::filesystem::path& path)
    : path_(path), target_(target_of(path)), partial_(target_) {}

PartialFile::PartialFile(PartialFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      partial_(std::move(other.partial_)),
      mode_(other.mode_),
      owned_(std::move(other.owned_)) {
  other.owned_.reset();
}

PartialFile::~PartialFile() {
  if (owned_) (void)::unlink(partial_.c_str());
}

Result<PartialFile> PartialFile::create(const std::filesystem::path& path) {
  PartialFile file(path);
  struct stat old = {};
  const bool exists = ::stat(file.target_.c_str(), &old) == 0;
  if (exists && S_ISDIR(old.st_mode)) return write_error(path, EISDIR);
  RAVENCAL_RETURN_IF_ERROR(check_output(file.target_));
  if (exists && !S_ISREG(old.st_mode)) return file;
  if (exists) file.mode_ = old.st_mode & 0777U;
  RAVENCAL_RETURN_IF_ERROR(file.open_beside());
  return file;
}

Status PartialFile::open_beside() {
  constexpr int kNewFile = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
  // What replaces a file is nobody else's before it has that file's mode.
  const mode_t mode = mode_ ? S_IRUSR | S_IWUSR : 0666;
  std::random_device random;
  int file = -1;
  do {
    partial_ = fmt::format("{}.{:08x}.partial", target_.string(), random());
    owned_.emplace(partial_);  // before it is there, so that no signal leaves it behind
    file = ::open(partial_.c_str(), kNewFile, mode);
  } while (file < 0 && errno == EEXIST);
  if (file < 0) {
    const int reason = errno;
    owned_.reset();
    return write_error(path_, reason);
  }
  ::close(file);
  return {};
}

Status PartialFile::publish(Replace replace) {
  if (!owned_) return {};
  const int file = ::open(partial_.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
  if (file < 0) return write_error(path_, errno);
  const bool whole = (!mode_ || ::fchmod(file, *mode_) == 0) && ::fsync(file) == 0;
  const int reason = errno;
  ::close(file);
  if (!whole) return write_error(path_, reason);
  if (replace == Replace::kNo && !give_new_name(partial_, target_)) {
    return errno == EEXIST ? exists_already(path_) : write_error(path_, errno);
  }
  if (replace == Replace::kYes && std::rename(partial_.c_str(), target_.c_str()) != 0)
    return write_error(path_, errno);
  owned_.reset();
  return {};
}

Error exists_already(const std::filesystem::path& path) {
  return {ErrorCode::kUsage,
          fmt::format("{}: exists already; remove it or choose another name", path.string())};
}

Error write_error(const std::filesystem::path& path, int reason) {
  return {ErrorCode::kIo,
          fmt::format("{}: cannot be written: {}; choose a folder that exists, is writable and has "
                      "room",
                      path.string(), std::strerror(reason))};
}

}  // namespace ravencal::core
