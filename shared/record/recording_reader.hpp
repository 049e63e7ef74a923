// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Reads a whole `.db` recording, also one that is being written: what is committed at the moment
/// of the call. Values are converted to SI units, NULL becomes NaN. Checks the format version, the
/// units, and that time never runs backwards. Not for real-time threads.
/// True for channels that a reader shall keep; an empty one keeps all.
using ChannelFilter = std::function<bool(const Channel&)>;

core::Result<Recording> read_recording(const std::filesystem::path& path,
                                       const ChannelFilter& keep = {});

/// Only its events, however long the recording is.
core::Result<std::vector<Event>> read_events(const std::filesystem::path& path);

}  // namespace ravencal::record
