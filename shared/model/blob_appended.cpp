// SPDX-License-Identifier: Apache-2.0
#include "model/blob_appended.hpp"

#include <limits>

#include "model/blob_checks.hpp"
#include "model/kinds.hpp"

namespace ravencal::model {

using namespace blob;

namespace {

using Header = std::span<const std::byte, kHeaderBytes>;

/// Just above pi, so that pi rounded to f32 passes.
constexpr float kMaxPhaseMargin = 3.1415930F;

/// A name may be empty and contain blanks.
BlobCheck check_name(Header header, std::size_t from) noexcept {
  const bool valid = text_length(header, from, kOriginTextBytes, ' ') < kOriginTextBytes;
  return valid ? BlobCheck{} : BlobCheck{BlobStatus::kOrigin, from};
}

BlobCheck check_origin(Header header) noexcept {
  const std::byte* const at = header.data();
  if (load_u32(at + kArmAt) > static_cast<std::uint32_t>(Arm::kGreen)) {
    return {BlobStatus::kOrigin, kArmAt};
  }
  if (load_u32(at + kCoordinatesAt) > static_cast<std::uint32_t>(Coordinates::kCorrected)) {
    return {BlobStatus::kOrigin, kCoordinatesAt};
  }
  const BlobCheck robot = check_name(header, kRobotAt);
  return robot.ok() ? check_name(header, kControllerAt) : robot;
}

BlobCheck check_margins(Header header, bool known) noexcept {
  if (!known) return check_zero(header, kGainMarginAt, kLoopTailAt);
  const float gain = load_f32(header.data() + kGainMarginAt);
  if (!(gain >= 0.0F && gain <= kMaxGainMargin)) return {BlobStatus::kLoopGain, kGainMarginAt};
  const float phase = load_f32(header.data() + kPhaseMarginAt);
  if (!(phase >= 0.0F && phase <= kMaxPhaseMargin)) return {BlobStatus::kLoopGain, kPhaseMarginAt};
  return {};
}

BlobCheck check_gains(Header header, bool known, std::uint32_t outputs) noexcept {
  if (!known) return check_zero(header, kLoopGainsAt, kHeaderBytes);
  for (std::size_t group = 0; group < kLoopGroupCount; ++group) {
    const std::size_t row = kLoopGainsAt + group * kLoopLanes * sizeof(float);
    for (std::size_t j = 0; j < outputs; ++j) {
      const std::size_t at = row + j * sizeof(float);
      const float gain = load_f32(header.data() + at);
      if (!(gain >= 0.0F && gain <= std::numeric_limits<float>::max())) {
        return {BlobStatus::kLoopGain, at};
      }
    }
    const BlobCheck zero =
        check_zero(header, row + outputs * sizeof(float), row + kLoopLanes * sizeof(float));
    if (!zero.ok()) return zero;
  }
  return {};
}

}  // namespace

BlobCheck check_appended(Header header, std::uint32_t outputs) noexcept {
  const BlobCheck origin = check_origin(header);
  if (!origin.ok()) return origin;
  const std::uint32_t flags = load_u32(header.data() + kLoopFlagsAt);
  if (flags > (kLoopGainsKnown | kLoopMarginsKnown) || flags == kLoopMarginsKnown) {
    return {BlobStatus::kLoopGain, kLoopFlagsAt};
  }
  const bool known = (flags & kLoopGainsKnown) != 0;
  if (!known && load_u32(header.data() + kLoopRowsAt) != 0) {
    return {BlobStatus::kLoopGain, kLoopRowsAt};
  }
  const BlobCheck margins = check_margins(header, (flags & kLoopMarginsKnown) != 0);
  if (!margins.ok()) return margins;
  const BlobCheck tail = check_zero(header, kLoopTailAt, kLoopGainsAt);
  return tail.ok() ? check_gains(header, known, outputs) : tail;
}

}  // namespace ravencal::model
