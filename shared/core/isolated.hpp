// SPDX-License-Identifier: Apache-2.0
//
// Work of a library that trusts the bytes of a file, in a child process: whether it crashes, asks
// for more memory than there is or finds no end, the program goes on and says so. What the child
// sends is checked like bytes of the file itself. Any thread; not for real-time threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::core {

/// Takes one piece of what the work gives, in order; an error ends the work.
using TakePiece = std::function<Status(std::span<const std::uint8_t> piece)>;

/// Bounds of the child. 0: none.
struct Isolation {
  std::uint32_t cpu_s = 0;         ///< processor time
  std::uint32_t wall_s = 0;        ///< time that passes
  std::uint64_t memory_bytes = 0;  ///< beyond what the program has; not under sanitizers
  std::uint64_t sent_bytes = 0;    ///< all pieces together

  /// For reading a file: 10 s and a second for each 4 MiB, ten times that in all; 512 MiB and 8
  /// times its size; it gives at most 64 MiB and 100 times its size, which a compressed one of
  /// honest content stays below.
  static Isolation reading(const std::filesystem::path& file);
};

/// Runs `work` in a child process and gives what it sends to `take`. The child writes nothing to
/// the terminal and leaves no core file. Errors: those of `work` and `take`; `FILE: cannot be
/// DOING: ...` (kData) if the child crashes or passes a bound; kIo if there can be no child.
Status in_child(const std::filesystem::path& file, const char* doing, const Isolation& bounds,
                const std::function<Status(const TakePiece& send)>& work,
                const TakePiece& take = {});

/// A text as a piece, and pieces as texts.
Status send_text(const TakePiece& send, std::string_view text);
TakePiece texts_into(std::vector<std::string>& texts);

}  // namespace ravencal::core
