// SPDX-License-Identifier: Apache-2.0
//
// What the arm has with the plugin between network and joints: a run of its loop, summed up.
#pragma once

#include <filesystem>
#include <functional>
#include <span>

#include "core/result.hpp"
#include "host/loop.hpp"
#include "host/summary.hpp"
#include "record/recording.hpp"

namespace ravencal::host {

using KeepGoing = std::function<bool(double done)>;

/// Enables the correction and runs the loop to its end.
Summary run(const LoopOptions& options, plugin_host::Instance& plugin, RobotSource& source,
            const model::CalibrationModel& model, const KeepGoing& keep_going);

/// The recordings through the plugin, each from its start and as fast as the machine goes; figures
/// over all of them. Errors: those of the plugin; a recording without a channel of the model.
core::Result<Summary> replay(const std::filesystem::path& plugin,
                             const model::CalibrationModel& model,
                             std::span<const record::Recording* const> recordings,
                             const KeepGoing& keep_going);

}  // namespace ravencal::host
