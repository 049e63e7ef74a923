// SPDX-License-Identifier: Apache-2.0
#include "model/blob_view.hpp"

namespace ravencal::model {

using namespace blob;

const std::byte* BlobView::section(Section section) const noexcept {
  return bytes_.data() + section_entry(bytes_.data(), section).offset;
}

std::string_view BlobView::text(std::size_t at, std::size_t capacity) const noexcept {
  const char* const start = reinterpret_cast<const char*>(bytes_.data() + at);
  std::size_t length = 0;
  while (length < capacity && start[length] != '\0') ++length;
  return {start, length};
}

double BlobView::row_period_s() const noexcept { return load_f64(bytes_.data() + kRowPeriodAt); }

std::uint32_t BlobView::checksum() const noexcept {
  return load_u32(bytes_.data() + bytes_.size() - kTrailerBytes);
}

bool BlobView::is_signed() const noexcept {
  return load_u32(bytes_.data() + bytes_.size() - kTrailerBytes + kSignatureKindAt) != kUnsigned;
}

std::span<const std::byte> BlobView::signed_bytes() const noexcept {
  return bytes_.first(bytes_.size() - kTrailerBytes + kSignatureAt);
}

std::span<const std::byte> BlobView::signature() const noexcept {
  return bytes_.subspan(signed_bytes().size(), kSignatureBytes);
}

bool BlobView::has_appended() const noexcept { return load_u16(bytes_.data() + kMinorAt) >= 1; }

Arm BlobView::arm() const noexcept {
  return has_appended() ? static_cast<Arm>(load_u32(bytes_.data() + kArmAt)) : Arm::kUnknown;
}
Coordinates BlobView::coordinates() const noexcept {
  return has_appended() ? static_cast<Coordinates>(load_u32(bytes_.data() + kCoordinatesAt))
                        : Coordinates::kUnknown;
}
std::string_view BlobView::robot() const noexcept {
  return has_appended() ? text(kRobotAt, kOriginTextBytes) : std::string_view{};
}
std::string_view BlobView::controller() const noexcept {
  return has_appended() ? text(kControllerAt, kOriginTextBytes) : std::string_view{};
}

BlobLoop BlobView::loop() const noexcept {
  if (!has_appended()) return {};
  const std::byte* const at = bytes_.data();
  const std::uint32_t flags = load_u32(at + kLoopFlagsAt);
  return {(flags & kLoopGainsKnown) != 0, (flags & kLoopMarginsKnown) != 0,
          load_u32(at + kLoopRowsAt), load_f32(at + kGainMarginAt), load_f32(at + kPhaseMarginAt)};
}

float BlobView::loop_gain(LoopGroup group, std::size_t j) const noexcept {
  if (!has_appended()) return 0.0F;
  const std::size_t lane = static_cast<std::size_t>(group) * kLoopLanes + j;
  return load_f32(bytes_.data() + kLoopGainsAt + lane * sizeof(float));
}

BlobFeature BlobView::feature(std::size_t i) const noexcept {
  const std::byte* const at = section(kFeatures) + i * kFeatureBytes;
  const auto transform = static_cast<Transform>(at[kFeatureTransformAt]);
  const float parameter = load_f32(at + kFeatureParameterAt);
  return {load_u16(at),
          transform,
          load_u32(at + kFeatureLagAt),
          transform == Transform::kPlay ? parameter : 0.0F,
          is_mean(transform) ? parameter : 0.0F,
          is_travel_mean(transform) ? parameter : 0.0F,
          is_travel_mean(transform) ? load_u32(at + kFeatureAlongAt) - 1 : 0,
          text(static_cast<std::size_t>(at - bytes_.data()) + kFeatureNameAt, kFeatureNameBytes)};
}

double BlobView::input_mean(std::size_t i) const noexcept {
  return load_f64(section(kInputScaling) + i * sizeof(double));
}
double BlobView::input_scale(std::size_t i) const noexcept {
  return load_f64(section(kInputScaling) + (features_ + i) * sizeof(double));
}
double BlobView::input_min(std::size_t i) const noexcept {
  return load_f64(section(kInputRange) + i * sizeof(double));
}
double BlobView::input_max(std::size_t i) const noexcept {
  return load_f64(section(kInputRange) + (features_ + i) * sizeof(double));
}

packed::Precision BlobView::precision() const noexcept {
  return static_cast<packed::Precision>(load_u32(bytes_.data() + kPrecisionAt));
}

packed::PackedView BlobView::network() const noexcept { return {section(kNetwork)}; }

std::span<const std::byte> BlobView::network_bytes() const noexcept {
  const SectionEntry entry = section_entry(bytes_.data(), kNetwork);
  return bytes_.subspan(entry.offset, entry.bytes);
}

std::size_t BlobView::bytes_per_step() const noexcept {
  const std::size_t inputs = packed::padded(features_, packed::kLineLanes);
  const std::size_t outputs = packed::padded(outputs_, packed::kLineLanes);
  return network_bytes().size() + (4 * inputs + 2 * outputs) * sizeof(float) +
         trust_bytes(features_, trust_rank_);
}

float BlobView::trust_inverse_residual_variance() const noexcept {
  return load_f32(section(kTrust) + kTrustResidualAt);
}
float BlobView::trust_inverse_variance(std::size_t k) const noexcept {
  return load_f32(section(kTrust) + kTrustVariancesAt + k * sizeof(float));
}
float BlobView::trust_direction(std::size_t k, std::size_t i) const noexcept {
  return load_f32(section(kTrust) + kTrustDirectionsAt + k * trust_direction_bytes(features_) +
                  i * sizeof(float));
}
const float* BlobView::trust_directions() const noexcept {
  if (trust_rank_ == 0) return nullptr;
  return reinterpret_cast<const float*>(section(kTrust) + kTrustDirectionsAt);
}
float BlobView::trust_full_distance() const noexcept {
  return load_f32(section(kTrust) + kTrustFullAt);
}
float BlobView::trust_none_distance() const noexcept {
  return load_f32(section(kTrust) + kTrustNoneAt);
}

BlobOutput BlobView::output(std::size_t j) const noexcept {
  const std::byte* const record = section(kOutputs) + j * kOutputBytes;
  const auto at = static_cast<std::size_t>(record - bytes_.data());
  return {static_cast<std::uint8_t>(record[0]), text(at + kOutputJointAt, kOutputJointBytes),
          text(at + kOutputChannelAt, kOutputChannelBytes),
          text(at + kOutputUnitAt, kOutputUnitBytes)};
}

double BlobView::output_mean(std::size_t j) const noexcept {
  return load_f64(section(kOutputScaling) + j * sizeof(double));
}
double BlobView::output_scale(std::size_t j) const noexcept {
  return load_f64(section(kOutputScaling) + (outputs_ + j) * sizeof(double));
}

double BlobView::self_test_tolerance(std::size_t j) const noexcept {
  return load_f64(section(kSelfTest) + j * sizeof(double));
}
double BlobView::self_test_output(std::size_t row, std::size_t j) const noexcept {
  return load_f64(section(kSelfTest) + (outputs_ * (1 + row) + j) * sizeof(double));
}
float BlobView::self_test_input(std::size_t row, std::size_t i) const noexcept {
  const std::size_t doubles = outputs_ * (1 + std::size_t{self_tests_});
  return load_f32(section(kSelfTest) + doubles * sizeof(double) +
                  (row * features_ + i) * sizeof(float));
}

std::string_view BlobView::provenance() const noexcept {
  const SectionEntry entry = section_entry(bytes_.data(), kProvenance);
  return {reinterpret_cast<const char*>(bytes_.data() + entry.offset), entry.bytes};
}

}  // namespace ravencal::model
