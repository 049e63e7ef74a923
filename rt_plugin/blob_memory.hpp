// SPDX-License-Identifier: Apache-2.0
//
// A weight file in memory of the plugin's own, in which the kernels run the network: huge pages and
// locked in RAM where the system allows it, touched in any case. Read once, so that what was
// checked is what runs, whatever happens to the file. Not for the real-time thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ravencal::rt {

class BlobMemory {
 public:
  enum class Status : std::uint8_t { kOk, kUnreadable, kNoMemory, kUntrusted };

  BlobMemory() = default;
  ~BlobMemory() { free(bytes_); }
  BlobMemory(const BlobMemory&) = delete;
  BlobMemory& operator=(const BlobMemory&) = delete;

  /// Reads the whole file. An empty file gives no bytes and is no failure of its own. kUntrusted:
  /// others may write it (file_access.hpp), and `why` says so in a sentence; nothing was read.
  Status read(const char* path, std::span<char> why) noexcept;

  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return bytes_; }
  [[nodiscard]] bool locked() const noexcept { return locked_; }

  /// Hands the memory to the caller, who gives it to free().
  std::span<std::byte> release() noexcept {
    const std::span<std::byte> bytes = bytes_;
    bytes_ = {};
    return bytes;
  }
  static void free(std::span<std::byte> bytes) noexcept;

 private:
  std::span<std::byte> bytes_;
  bool locked_ = false;
};

}  // namespace ravencal::rt
