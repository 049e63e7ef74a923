// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <random>
#include <system_error>
#include <utility>

#include "core/output_place.hpp"
#include "core/temporary_folder.hpp"
#include "core/whole_file.hpp"
#include "core/write_all.hpp"

namespace ravencal::core {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "file";  // in a folder of its own
constexpr int kMostTries = 10;         // while others make and remove the same name

std::atomic<OutputGroup*> group{nullptr};

bool is_same_file(const struct stat& a, const struct stat& b) {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

/// The folder in which a file becomes whole; a stream takes it from anywhere.
fs::path beginning_of_folder(const OutputPlace& place) {
  return place.is_stream() ? temporary_place() / "ravencal" : place.path;
}

}  // namespace

/// The file is reached by the folder's descriptor: in a folder that others may write to, they could
/// exchange the name of this one.
struct PartialFile::Impl {
  Impl(fs::path written, OutputPlace found) : path(std::move(written)), place(std::move(found)) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { clear(); }

  Status open();
  Status make_folder();
  /// All of it is on the disk, with the mode that it will have.
  Status settle();
  int exchange_name();
  int take_free_name();
  /// The target's name, if check_output() still lets it.
  Status take_name();
  Status pour();
  void give_back();
  /// Removes what is left beside the target.
  void clear();

  fs::path path;  ///< as the user wrote it, for messages
  OutputPlace place;
  fs::path folder, partial;
  int folder_file = -1, file = -1;
  bool only_new = false;
  bool named = false;      ///< it has the target's name
  bool exchanged = false;  ///< what had the name lies in its place
  std::optional<Unfinished> noted_folder, noted_file;
};

void PartialFile::Impl::clear() {
  if (folder_file >= 0) {
    (void)::unlinkat(folder_file, kName, 0);  // also what had the target's name
    ::close(std::exchange(folder_file, -1));
  }
  if (!folder.empty()) (void)::rmdir(std::exchange(folder, {}).c_str());
  if (file >= 0) ::close(std::exchange(file, -1));
  noted_file.reset();
  noted_folder.reset();
}

Status PartialFile::Impl::make_folder() {
  const std::string beginning = beginning_of_folder(place).string();
  std::random_device random;
  bool made = false;
  do {
    folder = fmt::format("{}.{:08x}.partial", beginning, random());
    noted_folder.emplace(folder);  // before it is there, so that no signal leaves it behind
    made = ::mkdir(folder.c_str(), 0700) == 0;
  } while (!made && errno == EEXIST);
  if (made) folder_file = ::open(folder.c_str(), O_DIRECTORY | O_NOFOLLOW | O_RDONLY | O_CLOEXEC);
  if (folder_file >= 0) return {};
  const int reason = errno;
  if (!made) folder.clear();
  noted_folder.reset();
  return write_error(path, reason);
}

Status PartialFile::Impl::open() {
  RAVENCAL_RETURN_IF_ERROR(make_folder());
  struct stat opened = {};
  if (::fstat(folder_file, &opened) != 0 || opened.st_uid != ::geteuid())
    return write_error(path, EACCES);  // another user's, of the same name
  partial = folder / kName;
  noted_file.emplace(partial);
  file = ::openat(folder_file, kName, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file < 0) return write_error(path, errno);
  return {};
}

Status PartialFile::Impl::settle() {
  struct stat opened = {};
  struct stat found = {};
  const bool is_ours = ::fstat(file, &opened) == 0 &&
                       ::fstatat(folder_file, kName, &found, AT_SYMLINK_NOFOLLOW) == 0 &&
                       is_same_file(opened, found);
  if (!is_ours) return io_error(fmt::format("{}: the file beside it was exchanged", path.string()));
  const bool replaces = place.kind == OutputPlace::Kind::kFile;
  if (replaces && ::fchmod(file, place.status.st_mode & 0777U) != 0)
    return write_error(path, errno);
  if (!place.is_stream() && ::fsync(file) != 0) return write_error(path, errno);
  return {};
}

/// 0, or errno.
int PartialFile::Impl::exchange_name() {
  const char* const target = place.path.c_str();
  struct stat there = {};
  if (::lstat(target, &there) != 0) return errno;
  if (!S_ISREG(there.st_mode)) return EISDIR;  // or a link: neither is replaced
  exchanged = ::renameat2(folder_file, kName, AT_FDCWD, target, RENAME_EXCHANGE) == 0;
  // Not every file system can.
  named = exchanged || (errno == EINVAL && ::renameat(folder_file, kName, AT_FDCWD, target) == 0);
  return named ? 0 : errno;
}

/// 0, or errno; EEXIST where anything has the name.
int PartialFile::Impl::take_free_name() {
  const char* const target = place.path.c_str();
  named = ::renameat2(folder_file, kName, AT_FDCWD, target, RENAME_NOREPLACE) == 0;
  if (!named && errno == EINVAL) {  // most file systems that cannot have links
    named = ::linkat(folder_file, kName, AT_FDCWD, target, 0) == 0 &&
            ::unlinkat(folder_file, kName, 0) == 0;
  }
  return named ? 0 : errno;
}

Status PartialFile::Impl::take_name() {
  int reason = 0;
  for (int tried = 0; tried < kMostTries; ++tried) {
    // Asked in this order, what another writer makes meanwhile is either refused or not replaced.
    const bool is_there = output_place(path).kind == OutputPlace::Kind::kFile;
    RAVENCAL_RETURN_IF_ERROR(check_output(path));
    if (is_there && only_new) return exists_already(path);
    reason = is_there ? exchange_name() : take_free_name();
    if (reason == 0) return {};
    if (reason != EEXIST && reason != ENOENT) break;
  }
  return reason == EEXIST ? exists_already(path) : write_error(path, reason);
}

/// Into the device, the pipe or the descriptor.
Status PartialFile::Impl::pour() {
  const int out = place.kind == OutputPlace::Kind::kDescriptor
                      ? ::fcntl(place.descriptor, F_DUPFD_CLOEXEC, 0)
                      : ::open(place.path.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
  if (out < 0) return write_error(path, errno);
  if (place.kind == OutputPlace::Kind::kDescriptor) (void)std::fflush(nullptr);  // what came before
  std::array<char, 65536> buffer{};
  off_t at = 0;
  ssize_t count = 0;
  bool written = true;
  while (written && (count = ::pread(file, buffer.data(), buffer.size(), at)) > 0) {
    written = write_all(out, {buffer.data(), static_cast<std::size_t>(count)});
    at += count;
  }
  const int reason = errno;
  ::close(out);
  if (!written || count < 0) return write_error(path, reason);
  return {};
}

void PartialFile::Impl::give_back() {
  if (!named) return;
  const char* const target = place.path.c_str();
  if (exchanged) {
    (void)::renameat2(folder_file, kName, AT_FDCWD, target, RENAME_EXCHANGE);
    exchanged = false;
    named = false;
    return;
  }
  struct stat opened = {};
  struct stat found = {};
  if (::fstat(file, &opened) == 0 && ::lstat(target, &found) == 0 && is_same_file(opened, found))
    (void)::unlink(target);
}

PartialFile::PartialFile(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
PartialFile::PartialFile(PartialFile&& other) noexcept = default;
PartialFile::~PartialFile() = default;

const fs::path& PartialFile::partial() const { return impl_->partial; }
int PartialFile::descriptor() const { return impl_->file; }
const fs::path& PartialFile::target() const { return impl_->place.path; }

Result<PartialFile> PartialFile::create(const fs::path& path) {
  RAVENCAL_RETURN_IF_ERROR(check_output(path));
  auto impl = std::make_shared<Impl>(path, output_place(path));
  RAVENCAL_RETURN_IF_ERROR(impl->open());
  return PartialFile(std::move(impl));
}

Status PartialFile::publish_new() {
  impl_->only_new = true;
  return publish();
}

Status PartialFile::publish() {
  RAVENCAL_RETURN_IF_ERROR(impl_->settle());
  OutputGroup* const waiting = group;
  if (waiting == nullptr || is_scratch(impl_->place.path)) return OutputGroup::publish({impl_});
  // What the process writes twice is the latter.
  OutputGroup::Files& files = waiting->waiting_;
  files.erase(std::remove_if(files.begin(), files.end(),
                             [&](const std::shared_ptr<Impl>& other) {
                               return !other->place.is_stream() &&
                                      other->place.path == impl_->place.path;
                             }),
              files.end());
  files.push_back(impl_);
  return {};
}

OutputGroup::OutputGroup() { group = this; }

OutputGroup::~OutputGroup() { group = nullptr; }

Status OutputGroup::publish() { return publish(waiting_); }

Status OutputGroup::publish(const Files& files) {
  Status status;
  const auto each = [&](bool streams, auto&& act) {
    for (const auto& file : files) {
      if (status.ok() && file->place.is_stream() == streams) status = act(*file);
    }
  };
  each(true, [](PartialFile::Impl& file) { return file.pour(); });
  each(false, [](PartialFile::Impl& file) { return file.take_name(); });
  for (const auto& file : files) {
    if (status.ok()) {
      if (file->named) may_renew(file->place.path);
      file->clear();
    } else {
      file->give_back();
    }
  }
  return status;
}

}  // namespace ravencal::core
