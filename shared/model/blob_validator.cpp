// SPDX-License-Identifier: Apache-2.0
//
// BlobView::open: every rule of shared/FORMATS.md ("Weights"), one function per part of the file.
#include <limits>

#include "model/blob_appended.hpp"
#include "model/blob_checks.hpp"
#include "model/blob_features.hpp"
#include "model/blob_view.hpp"

namespace ravencal::model {

using namespace blob;

namespace {

// std::isfinite without <cmath>'s overloads, so that the plugin needs no newer libm symbol.
bool finite(double value) noexcept { return value - value == 0.0; }

bool fits_float(double value) noexcept {
  constexpr auto kLargest = static_cast<double>(std::numeric_limits<float>::max());
  return value >= -kLargest && value <= kLargest;
}

}  // namespace

/// The checks of open(), in the order of BlobStatus; each returns the first fault it finds.
class BlobValidator {
 public:
  explicit BlobValidator(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {
    view_.bytes_ = bytes;
  }

  BlobCheck run() noexcept {
    using Check = BlobCheck (BlobValidator::*)() noexcept;
    constexpr Check kChecks[] = {&BlobValidator::check_identity,  &BlobValidator::check_checksum,
                                 &BlobValidator::check_trailer,   &BlobValidator::check_counts,
                                 &BlobValidator::check_network,   &BlobValidator::check_sections,
                                 &BlobValidator::check_features,  &BlobValidator::check_scaling,
                                 &BlobValidator::check_weights,   &BlobValidator::check_trust,
                                 &BlobValidator::check_outputs,   &BlobValidator::check_self_test,
                                 &BlobValidator::check_provenance};
    for (const Check check : kChecks) {
      const BlobCheck result = (this->*check)();
      if (!result.ok()) return result;
    }
    return {};
  }

  [[nodiscard]] const BlobView& view() const noexcept { return view_; }

 private:
  static BlobCheck refuse(BlobStatus status, std::size_t offset) noexcept {
    return {status, offset};
  }

  [[nodiscard]] const std::byte* at(std::size_t offset) const noexcept {
    return bytes_.data() + offset;
  }

  [[nodiscard]] std::size_t trailer() const noexcept { return bytes_.size() - kTrailerBytes; }

  [[nodiscard]] BlobCheck check_zero(std::size_t from, std::size_t to) const noexcept {
    return model::check_zero(bytes_, from, to);
  }

  BlobCheck check_identity() noexcept {
    if (bytes_.size() < kFirstHeaderBytes + kTrailerBytes) {
      return refuse(BlobStatus::kTooShort, bytes_.size());
    }
    for (std::size_t i = 0; i < kMagic.size(); ++i) {
      if (bytes_[i] != std::byte{kMagic[i]}) return refuse(BlobStatus::kBadMagic, i);
    }
    if (load_u16(at(kMajorAt)) != kMajor) return refuse(BlobStatus::kVersion, kMajorAt);
    const std::size_t file_bytes = load_u32(at(kFileBytesAt));
    if (file_bytes > bytes_.size()) return refuse(BlobStatus::kTooShort, bytes_.size());
    if (file_bytes != bytes_.size() || file_bytes > kMaxFileBytes || file_bytes % kAlignment != 0) {
      return refuse(BlobStatus::kSize, kFileBytesAt);
    }
    return {};
  }

  BlobCheck check_checksum() noexcept {
    if (load_u32(at(trailer())) != crc32c(bytes_.data(), trailer())) {
      return refuse(BlobStatus::kChecksum, trailer());
    }
    return {};
  }

  BlobCheck check_trailer() noexcept {
    const std::size_t kind_at = trailer() + kSignatureKindAt;
    const std::uint32_t kind = load_u32(at(kind_at));
    if (kind == kUnsigned) return check_zero(kind_at + 4, bytes_.size());
    if (kind != kEd25519) return refuse(BlobStatus::kSignature, kind_at);
    const BlobCheck zero = check_zero(kind_at + 4, trailer() + kSignatureAt);
    if (!zero.ok()) return zero;
    const std::size_t checksum_at = trailer() + kSignatureChecksumAt;
    if (load_u32(at(checksum_at)) != crc32c(at(trailer() + kSignatureAt), kSignatureBytes)) {
      return refuse(BlobStatus::kChecksum, checksum_at);
    }
    return check_zero(trailer() + kTrailerTailAt, bytes_.size());
  }

  BlobCheck check_counts() noexcept {
    header_bytes_ = load_u32(at(kHeaderBytesAt));
    // A later minor version may append to the header; its tail is skipped.
    const std::uint16_t minor = load_u16(at(kMinorAt));
    const bool newer = minor > kMinor;
    const std::size_t own_bytes = minor == 0 ? kFirstHeaderBytes : kHeaderBytes;
    if (header_bytes_ % kAlignment != 0 || header_bytes_ > trailer() || header_bytes_ < own_bytes ||
        (!newer && header_bytes_ != own_bytes)) {
      return refuse(BlobStatus::kSize, kHeaderBytesAt);
    }
    if (load_u32(at(kPrecisionAt)) > static_cast<std::uint32_t>(packed::Precision::kInt8)) {
      return refuse(BlobStatus::kPrecision, kPrecisionAt);
    }
    struct Count {
      std::size_t at;
      std::uint32_t limit;
      std::uint32_t& value;
    };
    for (const Count& count : {Count{kFeatureCountAt, kMaxFeatures, view_.features_},
                               Count{kLayerCountAt, kMaxLayers, view_.layers_},
                               Count{kOutputCountAt, kMaxOutputs, view_.outputs_},
                               Count{kSelfTestCountAt, kMaxSelfTests, view_.self_tests_}}) {
      count.value = load_u32(at(count.at));
      if (count.value == 0 || count.value > count.limit) {
        return refuse(BlobStatus::kCount, count.at);
      }
    }
    const double period_s = load_f64(at(kRowPeriodAt));
    if (!(period_s >= kMinRowPeriodS && period_s <= kMaxRowPeriodS)) {
      return refuse(BlobStatus::kPeriod, kRowPeriodAt);
    }
    view_.trust_rank_ = load_u32(at(kTrustRankAt));
    if (view_.trust_rank_ > kMaxTrustRank || view_.trust_rank_ > view_.features_) {
      return refuse(BlobStatus::kCount, kTrustRankAt);
    }
    if (load_u64(at(kReservedAt)) != 0) return refuse(BlobStatus::kReserved, kReservedAt);
    const std::size_t tail = kSectionTableAt + kSectionCount * kSectionEntryBytes;
    const BlobCheck zero = newer ? BlobCheck{} : check_zero(tail, kFirstHeaderBytes);
    if (!zero.ok() || minor == 0) return zero;
    return check_appended(bytes_.first<kHeaderBytes>(), view_.outputs_);
  }

  /// The network must have the layout of its precision, and the inputs and outputs of the counts.
  BlobCheck check_network() noexcept {
    // The sections before the network have sizes that the counts give.
    network_at_ = header_bytes_ + view_.features_ * kFeatureBytes +
                  2 * aligned(std::size_t{view_.features_} * 2 * sizeof(double));
    network_bytes_ = section_entry(bytes_.data(), kNetwork).bytes;
    if (network_at_ > trailer() || network_bytes_ > trailer() - network_at_) {
      return refuse(BlobStatus::kSection, kSectionTableAt + kNetwork * kSectionEntryBytes);
    }
    packed::PackedView network;
    if (!packed::open_anywhere(at(network_at_), network_bytes_, network)) {
      return refuse(BlobStatus::kLayer, network_at_);
    }
    if (network.header().layers != view_.layers_) return refuse(BlobStatus::kLayer, kLayerCountAt);
    for (std::size_t l = 0; l < view_.layers_; ++l) {
      const packed::PackedLayer layer = network.layer(l);
      if (!has_few_outputs(layer) && layer.precision != view_.precision()) {
        return refuse(BlobStatus::kPrecision, kPrecisionAt);
      }
    }
    if (network.layer(0).inputs != view_.features_) {
      return refuse(BlobStatus::kLayer, kFeatureCountAt);
    }
    if (network.layer(view_.layers_ - 1).outputs != view_.outputs_) {
      return refuse(BlobStatus::kLayer, kOutputCountAt);
    }
    return {};
  }

  /// Sections follow each other without gaps other than zero padding to 64 bytes.
  BlobCheck check_sections() noexcept {
    const std::size_t n = view_.features_;
    const std::size_t m = view_.outputs_;
    const std::size_t k = view_.self_tests_;
    const std::size_t provenance_bytes = section_entry(bytes_.data(), kProvenance).bytes;
    if (provenance_bytes > kMaxProvenanceBytes) {
      return refuse(BlobStatus::kSection, kSectionTableAt + kProvenance * kSectionEntryBytes + 4);
    }
    const std::size_t sizes[kSectionCount] = {n * kFeatureBytes,
                                              n * 2 * sizeof(double),
                                              n * 2 * sizeof(double),
                                              network_bytes_,
                                              trust_bytes(n, view_.trust_rank_),
                                              m * 2 * sizeof(double),
                                              m * kOutputBytes,
                                              (m + k * m) * sizeof(double) + k * n * sizeof(float),
                                              provenance_bytes};
    std::size_t offset = header_bytes_;
    for (std::size_t s = 0; s < kSectionCount; ++s) {
      const SectionEntry entry = section_entry(bytes_.data(), static_cast<Section>(s));
      const std::size_t end = offset + sizes[s];
      if (entry.offset != offset || entry.bytes != sizes[s] || end > trailer()) {
        return refuse(BlobStatus::kSection, kSectionTableAt + s * kSectionEntryBytes);
      }
      offset = aligned(end);
      const BlobCheck zero = check_zero(end, offset);
      if (!zero.ok()) return zero;
    }
    if (offset != trailer()) return refuse(BlobStatus::kSize, kFileBytesAt);
    return {};
  }

  BlobCheck check_features() noexcept {
    const SectionEntry entry = section_entry(bytes_.data(), kFeatures);
    return model::check_features(bytes_.subspan(entry.offset, entry.bytes), entry.offset,
                                 load_u16(at(kMinorAt)));
  }

  BlobCheck check_scale(Section section, std::size_t count) const noexcept {
    const std::size_t start = section_entry(bytes_.data(), section).offset;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t mean_at = start + i * sizeof(double);
      const std::size_t scale_at = start + (count + i) * sizeof(double);
      if (!fits_float(load_f64(at(mean_at)))) return refuse(BlobStatus::kScaling, mean_at);
      const double scale = load_f64(at(scale_at));
      // The plugin multiplies by 1 / scale in single precision, so that must be finite too.
      if (!fits_float(scale) || !(scale > 0.0) || !fits_float(1.0 / scale)) {
        return refuse(BlobStatus::kScaling, scale_at);
      }
    }
    return {};
  }

  BlobCheck check_scaling() noexcept {
    BlobCheck result = check_scale(kInputScaling, view_.features_);
    if (result.ok()) result = check_scale(kOutputScaling, view_.outputs_);
    if (!result.ok()) return result;
    const std::size_t start = section_entry(bytes_.data(), kInputRange).offset;
    for (std::size_t i = 0; i < view_.features_; ++i) {
      const double low = view_.input_min(i);
      const double high = view_.input_max(i);
      if (!fits_float(low) || !fits_float(high) || low > high) {
        return refuse(BlobStatus::kRange, start + i * sizeof(double));
      }
    }
    return {};
  }

  BlobCheck check_weights() noexcept {
    const packed::BadValue bad = packed::find_bad_value(view_.network());
    if (!bad.found) return {};
    return refuse(bad.in_padding ? BlobStatus::kReserved : BlobStatus::kWeight,
                  network_at_ + bad.at);
  }

  /// Directions are orthonormal; variances fall from the first to the last direction and to the
  /// residual, so that their inverses rise.
  BlobCheck check_trust() noexcept {
    const std::size_t rank = view_.trust_rank_;
    if (rank == 0) return {};
    const std::size_t start = section_entry(bytes_.data(), kTrust).offset;
    const auto inside = [](float value, float low, float high) {
      return value >= low && value <= high;  // false for NaN
    };
    constexpr float kLeast = std::numeric_limits<float>::min();
    float least = kLeast;
    for (std::size_t k = 0; k <= rank; ++k) {
      const std::size_t offset =
          start + (k < rank ? kTrustVariancesAt + k * sizeof(float) : kTrustResidualAt);
      const float inverse = load_f32(at(offset));
      if (!inside(inverse, least, kMaxInverseVariance)) return refuse(BlobStatus::kTrust, offset);
      least = inverse;
    }
    if (!inside(view_.trust_full_distance(), kLeast, std::numeric_limits<float>::max())) {
      return refuse(BlobStatus::kTrust, start + kTrustFullAt);
    }
    if (!inside(view_.trust_none_distance(), kLeast, std::numeric_limits<float>::max()) ||
        !(view_.trust_none_distance() > view_.trust_full_distance())) {
      return refuse(BlobStatus::kTrust, start + kTrustNoneAt);
    }
    BlobCheck zero = check_zero(start + kTrustHeadEnd, start + kTrustVariancesAt);
    if (!zero.ok()) return zero;
    zero = check_zero(start + kTrustVariancesAt + rank * sizeof(float), start + kTrustDirectionsAt);
    return zero.ok() ? check_directions(start + kTrustDirectionsAt) : zero;
  }

  BlobCheck check_directions(std::size_t start) noexcept {
    const std::size_t row_bytes = trust_direction_bytes(view_.features_);
    for (std::size_t k = 0; k < view_.trust_rank_; ++k) {
      const std::size_t row = start + k * row_bytes;
      const BlobCheck zero = check_zero(row + view_.features_ * sizeof(float), row + row_bytes);
      if (!zero.ok()) return zero;
      for (std::size_t other = 0; other <= k; ++other) {
        double product = other == k ? -1.0 : 0.0;
        for (std::size_t i = 0; i < view_.features_; ++i) {
          product += static_cast<double>(view_.trust_direction(k, i)) *
                     static_cast<double>(view_.trust_direction(other, i));
        }
        if (!(product >= -kMaxSkew && product <= kMaxSkew)) return refuse(BlobStatus::kTrust, row);
      }
    }
    return {};
  }

  BlobCheck check_outputs() noexcept {
    const std::size_t start = section_entry(bytes_.data(), kOutputs).offset;
    for (std::size_t j = 0; j < view_.outputs_; ++j) {
      const std::size_t record = start + j * kOutputBytes;
      const auto slot = static_cast<std::uint8_t>(bytes_[record]);
      if (slot >= 8 && slot != kNoSlot) return refuse(BlobStatus::kOutput, record);
      for (std::size_t other = 0; slot != kNoSlot && other < j; ++other) {
        if (view_.output(other).slot == slot) return refuse(BlobStatus::kOutput, record);
      }
      const BlobCheck zero = check_zero(record + 1, record + kOutputJointAt);
      if (!zero.ok()) return zero;
      if (!is_name(bytes_, record + kOutputJointAt, kOutputJointBytes) ||
          !is_name(bytes_, record + kOutputChannelAt, kOutputChannelBytes) ||
          !is_name(bytes_, record + kOutputUnitAt, kOutputUnitBytes)) {
        return refuse(BlobStatus::kOutput, record + kOutputJointAt);
      }
      const BlobCheck tail = check_zero(record + kOutputTailAt, record + kOutputBytes);
      if (!tail.ok()) return tail;
    }
    return {};
  }

  BlobCheck check_self_test() noexcept {
    const std::size_t start = section_entry(bytes_.data(), kSelfTest).offset;
    const std::size_t doubles = view_.outputs_ * (1 + std::size_t{view_.self_tests_});
    for (std::size_t i = 0; i < doubles; ++i) {
      const std::size_t offset = start + i * sizeof(double);
      const double value = load_f64(at(offset));
      const bool tolerance = i < view_.outputs_;
      if (!fits_float(value) || (tolerance && !(value > 0.0))) {
        return refuse(BlobStatus::kSelfTest, offset);
      }
    }
    const std::size_t inputs = start + doubles * sizeof(double);
    for (std::size_t i = 0; i < std::size_t{view_.self_tests_} * view_.features_; ++i) {
      const std::size_t offset = inputs + i * sizeof(float);
      if (!finite(static_cast<double>(load_f32(at(offset))))) {
        return refuse(BlobStatus::kSelfTest, offset);
      }
    }
    return {};
  }

  BlobCheck check_provenance() noexcept {
    const SectionEntry entry = section_entry(bytes_.data(), kProvenance);
    const std::string_view text = view_.provenance();
    if (text.size() < 2 || text.front() != '{' || text.back() != '}') {
      return refuse(BlobStatus::kProvenance, entry.offset);
    }
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (static_cast<unsigned char>(text[i]) < 0x20) {
        return refuse(BlobStatus::kProvenance, entry.offset + i);
      }
    }
    return {};
  }

  std::span<const std::byte> bytes_;
  BlobView view_;
  std::size_t header_bytes_ = 0;
  std::size_t network_at_ = 0;
  std::size_t network_bytes_ = 0;
};

BlobCheck BlobView::open(std::span<const std::byte> bytes, BlobView& view) noexcept {
  BlobValidator validator(bytes);
  const BlobCheck result = validator.run();
  if (result.ok()) view = validator.view();
  return result;
}

}  // namespace ravencal::model
