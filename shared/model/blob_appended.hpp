// SPDX-License-Identifier: Apache-2.0
//
// The rules of what minor version 1 appended to a blob's header: origin and loop gains.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "model/blob_format.hpp"
#include "model/blob_status.hpp"

namespace ravencal::model {

/// `header` is the first kHeaderBytes of a blob of minor version 1 or later with `outputs` outputs.
/// Offsets of the result count from the file's start.
BlobCheck check_appended(std::span<const std::byte, blob::kHeaderBytes> header,
                         std::uint32_t outputs) noexcept;

}  // namespace ravencal::model
