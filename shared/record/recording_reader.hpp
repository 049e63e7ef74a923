// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// True for channels that a reader shall keep; an empty one keeps all.
using ChannelFilter = std::function<bool(const Channel&)>;

/// Reads a whole `.db` recording, also one that is being written: what is committed at the moment
/// of the call. Values are converted to SI units, NULL becomes NaN. Checks the format version, the
/// units, and that time never runs backwards. `threads` read parts of a long one side by side (0:
/// all cores); what is read does not depend on it. Rows behind damage in the log of a writer that
/// never finished are lost: an error (kData), or with `skip_bad` an event `drop` and their number
/// in meta's `dropped_rows`. Not for real-time threads.
core::Result<Recording> read_recording(const std::filesystem::path& path,
                                       const ChannelFilter& keep = {}, unsigned threads = 0,
                                       bool skip_bad = false);

/// Only its events, however long the recording is.
core::Result<std::vector<Event>> read_events(const std::filesystem::path& path);

}  // namespace ravencal::record
