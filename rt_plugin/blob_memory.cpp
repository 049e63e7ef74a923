// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/blob_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

#include "model/blob_format.hpp"

namespace ravencal::rt {
namespace {

/// False if the file ends early or cannot be read.
bool read_all(int file, std::span<std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t count = ::read(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

}  // namespace

BlobMemory::Status BlobMemory::read(const char* path) noexcept {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return Status::kUnreadable;
  Status status = Status::kOk;
  // lseek, not fstat: fstat has a symbol version that older systems lack. A directory's end is far
  // beyond any blob.
  const off_t size = ::lseek(file, 0, SEEK_END);
  if (size < 0 || size > static_cast<off_t>(model::blob::kMaxFileBytes)) {
    status = Status::kUnreadable;
  } else if (size > 0) {
    // Private anonymous memory, touched by MAP_POPULATE: no page fault is left for the first step.
    void* const memory = ::mmap(nullptr, static_cast<std::size_t>(size), PROT_READ | PROT_WRITE,
                                MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (memory == MAP_FAILED) {
      status = Status::kNoMemory;
    } else {
      bytes_ = {static_cast<std::byte*>(memory), static_cast<std::size_t>(size)};
      locked_ = ::mlock(memory, bytes_.size()) == 0;
      const bool whole = ::lseek(file, 0, SEEK_SET) == 0 && read_all(file, bytes_);
      if (!whole) status = Status::kUnreadable;
      ::mprotect(memory, bytes_.size(), PROT_READ);
    }
  }
  ::close(file);
  return status;
}

void BlobMemory::free(std::span<std::byte> bytes) noexcept {
  if (!bytes.empty()) ::munmap(bytes.data(), bytes.size());
}

}  // namespace ravencal::rt
