// SPDX-License-Identifier: Apache-2.0
//
// The rules of a blob's feature records.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "model/blob_status.hpp"

namespace ravencal::model {

/// `records` are the whole records of the features section, which begins at byte `start` of the
/// file; `minor` is the file's minor version. Offsets of the result count from the file's start.
BlobCheck check_features(std::span<const std::byte> records, std::size_t start,
                         std::uint16_t minor) noexcept;

}  // namespace ravencal::model
