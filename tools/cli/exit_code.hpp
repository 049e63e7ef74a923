// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/result.hpp"

namespace ravencal::cli {

/// Exit codes of every program of the project.
enum ExitCode : int { kOk = 0, kFinding = 1, kUsage = 2, kData = 3, kDevice = 4 };

constexpr ExitCode exit_code_of(core::ErrorCode code) {
  switch (code) {
    case core::ErrorCode::kUsage:
      return kUsage;
    case core::ErrorCode::kDevice:
      return kDevice;
    case core::ErrorCode::kData:
    case core::ErrorCode::kIo:
      return kData;
  }
  return kData;
}

}  // namespace ravencal::cli
