// SPDX-License-Identifier: Apache-2.0
//
// Memory that other processes may read, found by a name. The memory is a System V segment, because
// nobody, not even its owner, can make one shorter: a file in its place could be truncated, and the
// next store would end the control process (SIGBUS). The kernel frees it with the last process that
// has it. Beside it there is memory in which the same user alone may write. The name is a small
// file in /dev/shm, which says where both are.
//
// A name has one owner: the process that gave the memory that name, for as long as it lives. A file
// gets its name by link(2), which never replaces another, and is locked (flock) before that. Only
// who holds the lock of the file that a name leads to may take the name away. A child of fork() has
// neither memory nor name. Not for the real-time thread, but for words().
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ravencal::rt {

class NamedMemory {
 public:
  NamedMemory() = default;
  ~NamedMemory() { release(); }
  NamedMemory(const NamedMemory&) = delete;
  NamedMemory& operator=(const NamedMemory&) = delete;

  // Both: RAVENCAL_SUCCESS; _ERROR_MEMORY: no room; _ERROR_LIMIT: a limit of the process;
  // _ERROR_IO: the system refuses. errno then says why, and release() is to be called.

  /// Takes so many bytes for others to read, and `request_bytes` for this user's programs to write
  /// in: zero, touched, and locked in RAM where the system allows it.
  std::int32_t reserve(std::size_t bytes, std::size_t request_bytes) noexcept;
  /// Gives what was reserved the name /dev/shm`name` (a slash, and no other) with `label` as the
  /// content of the file. Replaces a file that begins with `magic` and that nobody has locked.
  /// Also _ERROR_BUSY: a live process has that name, or it is something else's.
  std::int32_t publish(const char* name, std::span<const std::byte> label,
                       std::span<const std::byte> magic) noexcept;

  /// Whether /dev/shm`name` is neither this process's user's nor root's.
  static bool is_strangers(const char* name) noexcept;

  /// Gives memory and name back; a name that leads to another file by now is left alone.
  void release() noexcept;

  /// [rt] Null without memory: before reserve(), after release(), in a child of fork().
  [[nodiscard]] std::uint64_t* words() const noexcept {
    return held_ == nullptr ? nullptr : held_->shown.words;
  }
  [[nodiscard]] const std::uint64_t* requests() const noexcept {
    return held_ == nullptr ? nullptr : held_->asked.words;
  }
  /// For shmat(2).
  [[nodiscard]] int id() const noexcept { return held_->shown.id; }
  [[nodiscard]] int request_id() const noexcept { return held_->asked.id; }

  /// A System V segment.
  struct Segment {
    std::uint64_t* words = nullptr;
    int id = -1;

    /// Errors: reserve().
    std::int32_t take(std::size_t bytes, unsigned mode) noexcept;
    void detach() noexcept;
  };

  /// What this process has, in a page of its own: it outlives a host that frees its storage without
  /// destroy, and is this process's alone where that storage is shared.
  struct Held {
    Segment shown;
    Segment asked;
    int file = -1;         ///< holds the flock that says that the owner lives
    char path[96] = {};    ///< "": no name
    Held* next = nullptr;  ///< of all that this process has

    void detach() noexcept;
  };

 private:
  Held* held_ = nullptr;
};

}  // namespace ravencal::rt
