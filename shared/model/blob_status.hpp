// SPDX-License-Identifier: Apache-2.0
//
// Every reason for which a weight blob is refused, by name. Real-time side and tools share it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ravencal::model {

/// Why a blob was refused.
enum class BlobStatus : std::uint8_t {
  kOk,
  kTooShort,    ///< fewer bytes than a header, or than the header promises
  kBadMagic,    ///< not a ravencal blob
  kVersion,     ///< a major format version that this build does not read
  kSize,        ///< the header's sizes disagree with each other or with the file
  kChecksum,    ///< CRC-32C differs: damaged or changed
  kSignature,   ///< a kind of signature that this build does not know
  kReserved,    ///< a field or padding that must be zero is not
  kSection,     ///< a section is not where, or not as long as, the counts demand
  kCount,       ///< a count is zero or above its limit
  kPrecision,   ///< weights of a precision that this build does not read
  kFeature,     ///< an input's channel, transform or parameter is invalid
  kScaling,     ///< a mean is not finite, or a scale not finite and positive
  kRange,       ///< a trained range is not finite, or its minimum exceeds its maximum
  kTrust,       ///< a direction, variance or distance of the trust section is out of range
  kLayer,       ///< layer sizes do not chain, an activation is unknown, or the layout is not
                ///< that of the precision
  kWeight,      ///< a weight, bias or scale is not finite or out of range
  kOutput,      ///< an output's joint slot or names are invalid
  kPeriod,      ///< the row period is not in its range
  kSelfTest,    ///< a test vector or its tolerance is not finite
  kProvenance,  ///< the provenance is not text
  kOrigin,      ///< arm or coordinates are none that this build knows, or a name is not text
  kLoopGain,    ///< a loop gain or margin is negative, not finite, or there without its flag
};

/// Result of validating a blob: the reason and the byte at which it was seen.
struct BlobCheck {
  BlobStatus status = BlobStatus::kOk;
  std::size_t offset = 0;
  [[nodiscard]] constexpr bool ok() const noexcept { return status == BlobStatus::kOk; }
};

/// A sentence fragment for messages, e.g. "the checksum does not match". Static storage.
const char* describe(BlobStatus status) noexcept;

}  // namespace ravencal::model
