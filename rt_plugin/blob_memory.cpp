// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/blob_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

#include "model/blob_format.hpp"
#include "rt_plugin/file_access.hpp"

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

constexpr std::size_t kHugeBytes = std::size_t{2} << 20U;

/// What a blob of that size occupies: whole huge pages.
std::size_t mapped_bytes(std::size_t blob_bytes) noexcept {
  return (blob_bytes + kHugeBytes - 1) / kHugeBytes * kHugeBytes;
}

/// Private anonymous memory of whole, aligned huge pages where the system gives them, touched, so
/// that no page fault is left for the first step; null if there is none. One entry of the TLB then
/// covers the network, and no page's end stops the processor's prefetcher: with cold caches an f32
/// network takes a fifth less time. Without access until advised, because a host that called
/// mlockall(MCL_FUTURE) would have it filled with small pages at once.
std::byte* map_touched(std::size_t bytes) noexcept {
  void* const roomy =
      ::mmap(nullptr, bytes + kHugeBytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (roomy == MAP_FAILED) return nullptr;
  auto* const start = static_cast<std::byte*>(roomy);
  const std::size_t before =
      (kHugeBytes - reinterpret_cast<std::uintptr_t>(start) % kHugeBytes) % kHugeBytes;
  std::byte* const memory = start + before;
  if (before > 0) ::munmap(start, before);
  if (before < kHugeBytes) ::munmap(memory + bytes, kHugeBytes - before);
  ::madvise(memory, bytes, MADV_HUGEPAGE);
  if (::mprotect(memory, bytes, PROT_READ | PROT_WRITE) != 0) {
    ::munmap(memory, bytes);
    return nullptr;
  }
  constexpr std::size_t kSmallestPage = 4096;
  for (std::size_t at = 0; at < bytes; at += kSmallestPage) {
    *static_cast<volatile std::byte*>(memory + at) = std::byte{0};
  }
  // Pages stay as they are: gathering small ones into a huge one later would take them away from
  // the real-time thread for a moment.
  ::madvise(memory, bytes, MADV_NOHUGEPAGE);
  return memory;
}

}  // namespace

BlobMemory::Status BlobMemory::read(const char* path, std::span<char> why) noexcept {
  // Does not wait for the other end of a pipe.
  const int file = ::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return Status::kUnreadable;
  if (!only_owners_write(file, path, why)) {
    ::close(file);
    return Status::kUntrusted;
  }
  Status status = Status::kOk;
  // lseek, not fstat: fstat has a symbol version that older systems lack. A directory's end is far
  // beyond any blob.
  const off_t size = ::lseek(file, 0, SEEK_END);
  if (size < 0 || size > static_cast<off_t>(model::blob::kMaxFileBytes)) {
    status = Status::kUnreadable;
  } else if (size > 0) {
    const std::size_t mapped = mapped_bytes(static_cast<std::size_t>(size));
    std::byte* const memory = map_touched(mapped);
    if (memory == nullptr) {
      status = Status::kNoMemory;
    } else {
      bytes_ = {memory, static_cast<std::size_t>(size)};
      locked_ = ::mlock(memory, mapped) == 0;  // a part would split its huge page
      const bool whole = ::lseek(file, 0, SEEK_SET) == 0 && read_all(file, bytes_);
      if (!whole) status = Status::kUnreadable;
      ::mprotect(memory, mapped, PROT_READ);
    }
  }
  ::close(file);
  return status;
}

void BlobMemory::free(std::span<std::byte> bytes) noexcept {
  if (!bytes.empty()) ::munmap(bytes.data(), mapped_bytes(bytes.size()));
}

}  // namespace ravencal::rt
