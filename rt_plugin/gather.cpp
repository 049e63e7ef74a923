// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/gather.hpp"

#include <cstring>

#include "core/catalogue.hpp"

namespace ravencal::rt {
namespace {

using core::RavenField;
using Kind = ChannelReader::Kind;

constexpr double kMetresPerMicrometre = 1e-6;

/// Where a field lies: in ravencal_arm, or in ravencal_state if it is not per arm.
struct FieldPlace {
  Kind kind = Kind::kTime;
  std::size_t offset = 0;
  double to_si = 1.0;
  bool position = false;
};

FieldPlace place_of(RavenField field) noexcept {
  switch (field) {
    case RavenField::kTime:
      return {Kind::kTime, 0};
    case RavenField::kRunlevel:
      return {Kind::kInt32, offsetof(ravencal_state, runlevel)};
    case RavenField::kSublevel:
      return {Kind::kInt32, offsetof(ravencal_state, sublevel)};
    case RavenField::kLastSeq:
      return {Kind::kInt32, offsetof(ravencal_state, last_seq)};
    case RavenField::kType:
      return {Kind::kInt32, offsetof(ravencal_arm, type)};
    case RavenField::kJpos:
      return {Kind::kFloat, offsetof(ravencal_arm, jpos_ji), 1.0, true};
    case RavenField::kMpos:
      return {Kind::kFloat, offsetof(ravencal_arm, mpos_rad), 1.0, true};
    case RavenField::kEncVals:
      return {Kind::kInt32, offsetof(ravencal_arm, enc_counts), 1.0, true};
    case RavenField::kEncOffsets:
      return {Kind::kInt32, offsetof(ravencal_arm, enc_offset_counts)};
    case RavenField::kMvel:
      return {Kind::kFloat, offsetof(ravencal_arm, mvel_rad_per_s)};
    case RavenField::kJvel:
      return {Kind::kFloat, offsetof(ravencal_arm, jvel_ji)};
    case RavenField::kPos:
      return {Kind::kInt32, offsetof(ravencal_arm, pos_um), kMetresPerMicrometre, true};
    case RavenField::kOri:
      return {Kind::kFloat, offsetof(ravencal_arm, ori), 1.0, true};
    case RavenField::kPosD:
      return {Kind::kInt32, offsetof(ravencal_arm, pos_d_um), kMetresPerMicrometre};
    case RavenField::kOriD:
      return {Kind::kFloat, offsetof(ravencal_arm, ori_d)};
    case RavenField::kDac:
      return {Kind::kInt32, offsetof(ravencal_arm, dac_counts)};
    case RavenField::kTau:
      return {Kind::kFloat, offsetof(ravencal_arm, tau_n_m)};
    case RavenField::kMposD:
      return {Kind::kFloat, offsetof(ravencal_arm, mpos_d_rad)};
    case RavenField::kJposD:
      return {Kind::kFloat, offsetof(ravencal_arm, jpos_d_ji)};
    case RavenField::kGraspD:
      return {Kind::kFloat, offsetof(ravencal_arm, grasp_d_rad)};
    case RavenField::kJacVel:
      return {Kind::kFloat, offsetof(ravencal_arm, jac_vel)};
    case RavenField::kJacF:
      return {Kind::kFloat, offsetof(ravencal_arm, jac_f)};
  }
  return {};
}

struct Element {
  RavenField field = RavenField::kTime;
  std::size_t element = 0;
  std::size_t arm = 0;
};

Element element_of(std::size_t catalogue_index) noexcept {
  std::size_t field = core::kRavenFieldCount - 1;
  while (core::kRavenFields[field].first > catalogue_index) --field;
  const core::RavenFieldInfo& info = core::kRavenFields[field];
  const std::size_t within = catalogue_index - info.first;
  return {static_cast<RavenField>(field), within % info.count, within / info.count};
}

}  // namespace

ChannelReader reader_of(std::size_t catalogue_index) noexcept {
  const Element at = element_of(catalogue_index);
  const FieldPlace place = place_of(at.field);
  std::size_t offset = place.offset + at.element * 4;  // int32_t and float alike
  if (core::info_of(at.field).per_arm) {
    offset += offsetof(ravencal_state, arm) + at.arm * sizeof(ravencal_arm);
  }
  return {place.kind, core::is_cycle_old_at_hook(at.field), static_cast<std::uint16_t>(offset), 1,
          place.to_si};
}

bool is_position(std::size_t catalogue_index) noexcept {
  const Element at = element_of(catalogue_index);
  return at.arm == 0 && place_of(at.field).position;
}

void gather(std::span<const ChannelReader> readers, const ravencal_state& current,
            const ravencal_state& latched, float time_s, float* values) noexcept {
  for (const ChannelReader& reader : readers) {
    const auto* from =
        reinterpret_cast<const std::byte*>(reader.latched ? &latched : &current) + reader.offset;
    float* const end = values + reader.count;
    if (reader.kind == Kind::kTime) {
      *values = time_s;
    } else if (reader.kind == Kind::kFloat) {
      for (; values != end; ++values, from += sizeof *values) {
        std::memcpy(values, from, sizeof *values);
      }
    } else {
      for (; values != end; ++values, from += sizeof *values) {
        std::int32_t integer = 0;
        std::memcpy(&integer, from, sizeof integer);
        // In double precision, as a recording is read: the same bits.
        *values = static_cast<float>(integer * reader.to_si);
      }
    }
    values = end;
  }
}

}  // namespace ravencal::rt
