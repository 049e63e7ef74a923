// SPDX-License-Identifier: Apache-2.0
//
// SQLite reads a write-ahead log (`-wal`) up to the first frame whose checksum is wrong, and says
// nothing of what lies behind it. A writer that was killed leaves such a frame at the end only; one
// before further commits is damage. Private to record/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "core/result.hpp"

namespace ravencal::record {

struct LogDamage {
  std::int64_t frame = 0;     ///< first that is damaged, from 1; 0: the log's own header
  std::int64_t last_row = 0;  ///< largest number of a sample from there on; 0: none can be told
};

/// Damage in the log beside the recording `path`, whose samples have `columns` columns, t_ns among
/// them; nothing where there is no log. To be called within a read transaction, so that a writer
/// that is at work does not begin the log anew. Errors: kIo.
core::Result<std::optional<LogDamage>> find_log_damage(const std::filesystem::path& path,
                                                       std::size_t columns);

}  // namespace ravencal::record
