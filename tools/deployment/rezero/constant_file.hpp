// SPDX-License-Identifier: Apache-2.0
//
// The constant of a homing as a file beside the weights, `W.blob.homing.json`
// (shared/FORMATS.md). Weights and signature stay as they are. The file proves nothing: the plugin
// takes its constant where weights and homing are those that it names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "ravencal/control.h"
#include "rezero/constant.hpp"
#include "rezero/reading.hpp"

namespace ravencal::rezero {

struct ConstantFile {
  std::uint32_t weights_checksum = 0;  ///< ravencal_info.checksum of the weights
  Homing homing{};
  std::string source;            ///< of the reading
  std::int64_t realtime_ns = 0;  ///< since 1970, when it was made
  std::vector<JointConstant> joints;
};

/// `weights` with ".homing.json" behind.
std::filesystem::path path_beside(const std::filesystem::path& weights);

/// Errors: kIo.
core::Status write_constant(const ConstantFile& file, const std::filesystem::path& path);

/// Errors: kIo; kData for what is no such file, of another version, or changed by hand or accident.
core::Result<ConstantFile> read_constant(const std::filesystem::path& path);

/// Whether such a file lies there.
bool is_constant_file(const std::filesystem::path& path);

/// As the plugin takes it; joints that it does not correct are left out.
ravencal_homing_constant for_plugin(const ConstantFile& file);

}  // namespace ravencal::rezero
