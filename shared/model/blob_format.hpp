// SPDX-License-Identifier: Apache-2.0
//
// Byte layout of the weight blob, version 2.2: the numbers of shared/FORMATS.md ("Weights") as
// constants. Writer and view use nothing else. All values are little-endian.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace ravencal::model::blob {

inline constexpr std::array<std::uint8_t, 12> kMagic = {0x89, 'R', 'A', 'V',  'E',  'N',
                                                        'C',  'A', 'L', 0x0D, 0x0A, 0x1A};
inline constexpr std::uint16_t kMajor = 2;
inline constexpr std::uint16_t kMinor = 2;          ///< the latest that this build reads
inline constexpr std::uint16_t kMinorOfHeader = 1;  ///< the first with the header of kHeaderBytes
inline constexpr std::uint16_t kMinorOfMeans = 2;   ///< the first with exponential means
inline constexpr std::size_t kAlignment = 64;

// Offsets within the header.
inline constexpr std::size_t kMajorAt = 12;
inline constexpr std::size_t kMinorAt = 14;
inline constexpr std::size_t kHeaderBytesAt = 16;
inline constexpr std::size_t kFileBytesAt = 20;
inline constexpr std::size_t kPrecisionAt = 24;
inline constexpr std::size_t kFeatureCountAt = 28;
inline constexpr std::size_t kLayerCountAt = 32;
inline constexpr std::size_t kOutputCountAt = 36;
inline constexpr std::size_t kSelfTestCountAt = 40;
inline constexpr std::size_t kTrustRankAt = 44;
inline constexpr std::size_t kRowPeriodAt = 48;
inline constexpr std::size_t kReservedAt = 56;
inline constexpr std::size_t kSectionTableAt = 64;
inline constexpr std::size_t kSectionEntryBytes = 8;
inline constexpr std::size_t kFirstHeaderBytes = 192;  ///< of minor version 0, and what all have

// Appended by minor version 1.
inline constexpr std::size_t kArmAt = 192;
inline constexpr std::size_t kCoordinatesAt = 196;
inline constexpr std::size_t kRobotAt = 200;
inline constexpr std::size_t kControllerAt = 232;
inline constexpr std::size_t kOriginTextBytes = 32;
inline constexpr std::size_t kLoopFlagsAt = 264;
inline constexpr std::size_t kLoopRowsAt = 268;
inline constexpr std::size_t kGainMarginAt = 272;
inline constexpr std::size_t kPhaseMarginAt = 276;
inline constexpr std::size_t kLoopTailAt = 280;
inline constexpr std::size_t kLoopGainsAt = 320;
inline constexpr std::size_t kLoopLanes = 16;  ///< outputs of a group's row
inline constexpr std::size_t kHeaderBytes = 512;
inline constexpr std::uint32_t kLoopGainsKnown = 1;
inline constexpr std::uint32_t kLoopMarginsKnown = 2;
inline constexpr float kMaxGainMargin = 1e6F;  ///< stands for infinity

/// Sections, in file order.
enum Section : std::size_t {
  kFeatures,
  kInputScaling,
  kInputRange,
  kNetwork,
  kTrust,
  kOutputScaling,
  kOutputs,
  kSelfTest,
  kProvenance,
  kSectionCount,
};

inline constexpr std::size_t kFeatureBytes = 64;
inline constexpr std::size_t kFeatureTransformAt = 2;
inline constexpr std::size_t kFeatureLagAt = 4;
inline constexpr std::size_t kFeatureParameterAt = 8;
inline constexpr std::size_t kFeatureAlongAt = 12;
inline constexpr std::size_t kFeatureNameAt = 16;
inline constexpr std::size_t kFeatureNameBytes = 48;
inline constexpr std::uint16_t kNoCatalogueIndex = 0xFFFF;

inline constexpr std::size_t kOutputBytes = 128;
inline constexpr std::size_t kOutputJointAt = 8;
inline constexpr std::size_t kOutputJointBytes = 32;
inline constexpr std::size_t kOutputChannelAt = 40;
inline constexpr std::size_t kOutputChannelBytes = 64;
inline constexpr std::size_t kOutputUnitAt = 104;
inline constexpr std::size_t kOutputUnitBytes = 16;
inline constexpr std::size_t kOutputTailAt = 120;
inline constexpr std::uint8_t kNoSlot = 0xFF;

// Offsets within the trust section; directions are f32 rows of padded inputs.
inline constexpr std::size_t kTrustResidualAt = 0;
inline constexpr std::size_t kTrustFullAt = 4;
inline constexpr std::size_t kTrustNoneAt = 8;
inline constexpr std::size_t kTrustHeadEnd = 12;
inline constexpr std::size_t kTrustVariancesAt = 64;
inline constexpr std::size_t kTrustDirectionsAt = 128;

// Offsets within the trailer.
inline constexpr std::size_t kTrailerBytes = 128;
inline constexpr std::size_t kSignatureKindAt = 4;
inline constexpr std::size_t kSignatureAt = 56;
inline constexpr std::size_t kSignatureBytes = 64;
inline constexpr std::size_t kSignatureChecksumAt = 120;
inline constexpr std::size_t kTrailerTailAt = 124;
inline constexpr std::uint32_t kUnsigned = 0;
inline constexpr std::uint32_t kEd25519 = 1;

// Limits: far above any calibration network, low enough that no size computation overflows.
inline constexpr std::uint32_t kMaxFeatures = 4096;
inline constexpr std::uint32_t kMaxLayers = 16;
inline constexpr std::uint32_t kMaxOutputs = 16;
inline constexpr std::uint32_t kMaxSelfTests = 64;
inline constexpr std::uint32_t kMaxTrustRank = 16;
inline constexpr float kMaxInverseVariance = 1e6F;  ///< of scaled inputs
inline constexpr double kMaxSkew = 1e-5;  ///< of a product of directions from that of orthonormal
inline constexpr std::uint32_t kMaxLagRows = 100000;
inline constexpr std::uint32_t kMaxProvenanceBytes = 1U << 20;
inline constexpr std::uint32_t kMaxFileBytes = 1U << 28;
inline constexpr double kMinRowPeriodS = 1e-4;
inline constexpr double kMaxRowPeriodS = 60.0;

constexpr std::size_t aligned(std::size_t bytes) noexcept {
  return (bytes + kAlignment - 1) / kAlignment * kAlignment;
}

/// Bytes of a direction of the trust section: f32 per input, padded with zeros to whole lines.
constexpr std::size_t trust_direction_bytes(std::size_t features) noexcept {
  return aligned(features * sizeof(float));
}
/// Bytes of the trust section; none of rank 0.
constexpr std::size_t trust_bytes(std::size_t features, std::size_t rank) noexcept {
  return rank == 0 ? 0 : kTrustDirectionsAt + rank * trust_direction_bytes(features);
}

/// CRC-32C (Castagnoli, polynomial 0x1EDC6F41 reflected, as in RFC 3720) of `bytes`.
std::uint32_t crc32c(const std::byte* bytes, std::size_t count) noexcept;

inline std::uint16_t load_u16(const std::byte* at) noexcept {
  return static_cast<std::uint16_t>(static_cast<unsigned>(at[0]) | static_cast<unsigned>(at[1])
                                                                       << 8U);
}
inline std::uint32_t load_u32(const std::byte* at) noexcept {
  return std::uint32_t{load_u16(at)} | std::uint32_t{load_u16(at + 2)} << 16U;
}
inline std::uint64_t load_u64(const std::byte* at) noexcept {
  return std::uint64_t{load_u32(at)} | std::uint64_t{load_u32(at + 4)} << 32U;
}
inline float load_f32(const std::byte* at) noexcept { return std::bit_cast<float>(load_u32(at)); }
inline double load_f64(const std::byte* at) noexcept { return std::bit_cast<double>(load_u64(at)); }

struct SectionEntry {
  std::size_t offset;
  std::size_t bytes;
};

inline SectionEntry section_entry(const std::byte* file, Section section) noexcept {
  const std::byte* const at = file + kSectionTableAt + section * kSectionEntryBytes;
  return {load_u32(at), load_u32(at + 4)};
}

}  // namespace ravencal::model::blob
