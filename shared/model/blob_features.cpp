// SPDX-License-Identifier: Apache-2.0
#include "model/blob_features.hpp"

#include <limits>

#include "model/blob_checks.hpp"
#include "model/blob_format.hpp"
#include "model/kinds.hpp"

namespace ravencal::model {

using namespace blob;

namespace {

/// What makes the input from its channel, and the number that it needs for that.
BlobCheck check_transform(const std::byte* record, std::uint16_t minor) noexcept {
  const auto number = static_cast<std::uint8_t>(record[kFeatureTransformAt]);
  const auto transform = static_cast<Transform>(number);
  const auto newest = minor < kMinorOfMeans ? Transform::kPlay : Transform::kTravelMeanOfAbs;
  if (number > static_cast<std::uint8_t>(newest))
    return {BlobStatus::kFeature, kFeatureTransformAt};
  if (record[kFeatureTransformAt + 1] != std::byte{0}) {
    return {BlobStatus::kReserved, kFeatureTransformAt + 1};
  }
  const std::uint32_t lag_rows = load_u32(record + kFeatureLagAt);
  const bool lag = transform == Transform::kLag;
  if (lag ? lag_rows == 0 || lag_rows > kMaxLagRows : lag_rows != 0) {
    return {BlobStatus::kFeature, kFeatureLagAt};
  }
  const float parameter = load_f32(record + kFeatureParameterAt);
  bool valid = load_u32(record + kFeatureParameterAt) == 0;
  if (transform == Transform::kPlay) {
    valid = parameter >= 0.0F && parameter <= std::numeric_limits<float>::max();
  }
  if (is_mean(transform)) valid = is_time_constant(parameter);
  if (is_travel_mean(transform)) valid = is_travel(parameter);
  return valid ? BlobCheck{} : BlobCheck{BlobStatus::kFeature, kFeatureParameterAt};
}

/// The input that is the position of a mean over travel.
BlobCheck check_along(std::span<const std::byte> records, std::size_t at) noexcept {
  const std::byte* const record = records.data() + at;
  if (!is_travel_mean(static_cast<Transform>(record[kFeatureTransformAt]))) {
    return check_zero(records.subspan(at), kFeatureAlongAt, kFeatureNameAt);
  }
  const std::size_t along = load_u32(record + kFeatureAlongAt);
  const bool valid =
      along >= 1 && along <= records.size() / kFeatureBytes &&
      static_cast<Transform>(records[(along - 1) * kFeatureBytes + kFeatureTransformAt]) ==
          Transform::kValue;
  return valid ? BlobCheck{} : BlobCheck{BlobStatus::kFeature, kFeatureAlongAt};
}

}  // namespace

BlobCheck check_features(std::span<const std::byte> records, std::size_t start,
                         std::uint16_t minor) noexcept {
  for (std::size_t at = 0; at < records.size(); at += kFeatureBytes) {
    BlobCheck check = check_transform(records.data() + at, minor);
    if (check.ok()) check = check_along(records, at);
    if (check.ok() && !is_name(records.subspan(at), kFeatureNameAt, kFeatureNameBytes)) {
      check = {BlobStatus::kFeature, kFeatureNameAt};
    }
    if (!check.ok()) return {check.status, start + at + check.offset};
  }
  return {};
}

}  // namespace ravencal::model
