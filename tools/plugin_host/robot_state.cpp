// SPDX-License-Identifier: Apache-2.0
#include "plugin_host/robot_state.hpp"

#include <cmath>

#include "core/units.hpp"

namespace ravencal::plugin_host {
namespace {

using core::RavenField;

constexpr double kMicrometresPerMetre = 1e6;

/// Factors from message units to SI, by catalogue index.
CatalogueValues make_factors() {
  CatalogueValues factors{};
  const auto entries = core::catalogue();
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const auto unit = core::find_unit(entries[i].message_unit);
    factors[i] = unit ? unit->to_si : 1.0;
  }
  return factors;
}

std::int32_t to_integer(double value) noexcept {
  return std::abs(value) < 2147483647.0 ? static_cast<std::int32_t>(std::lround(value)) : 0;
}

/// Reads one arm's fields out of the catalogue.
class ArmReader {
 public:
  ArmReader(std::span<const double, core::kCatalogueSize> values, bool other_arm)
      : values_(values), other_arm_(other_arm) {}

  template <std::size_t kCount>
  void read(RavenField field, float (&to)[kCount]) const noexcept {
    for (std::size_t e = 0; e < kCount; ++e) to[e] = static_cast<float>(at(field, e));
  }
  template <std::size_t kCount>
  void read(RavenField field, std::int32_t (&to)[kCount], double factor = 1.0) const noexcept {
    for (std::size_t e = 0; e < kCount; ++e) to[e] = to_integer(at(field, e) * factor);
  }
  [[nodiscard]] double at(RavenField field, std::size_t element = 0) const noexcept {
    return values_[core::catalogue_index(field, element, other_arm_)];
  }

 private:
  std::span<const double, core::kCatalogueSize> values_;
  bool other_arm_;
};

void fill_arm(const ArmReader& from, ravencal_arm& arm) noexcept {
  arm.type = to_integer(from.at(RavenField::kType));
  from.read(RavenField::kPos, arm.pos_um, kMicrometresPerMetre);
  from.read(RavenField::kPosD, arm.pos_d_um, kMicrometresPerMetre);
  from.read(RavenField::kOri, arm.ori);
  from.read(RavenField::kOriD, arm.ori_d);
  from.read(RavenField::kEncVals, arm.enc_counts);
  from.read(RavenField::kEncOffsets, arm.enc_offset_counts);
  from.read(RavenField::kDac, arm.dac_counts);
  from.read(RavenField::kTau, arm.tau_n_m);
  from.read(RavenField::kMpos, arm.mpos_rad);
  from.read(RavenField::kMposD, arm.mpos_d_rad);
  from.read(RavenField::kMvel, arm.mvel_rad_per_s);
  from.read(RavenField::kJpos, arm.jpos_ji);
  from.read(RavenField::kJposD, arm.jpos_d_ji);
  from.read(RavenField::kJvel, arm.jvel_ji);
  arm.grasp_d_rad = static_cast<float>(from.at(RavenField::kGraspD));
  from.read(RavenField::kJacVel, arm.jac_vel);
  from.read(RavenField::kJacF, arm.jac_f);
}

}  // namespace

CatalogueValues to_si(std::span<const double, core::kCatalogueSize> message) {
  static const CatalogueValues factors = make_factors();
  CatalogueValues values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = message[i] * factors[i];
  return values;
}

void fill_state(std::span<const double, core::kCatalogueSize> values_si, std::int64_t t_ns,
                bool homed, ravencal_state& state) noexcept {
  state.struct_size = sizeof state;
  state.t_ns = t_ns;
  const ArmReader own(values_si, false);
  state.runlevel = to_integer(own.at(RavenField::kRunlevel));
  state.sublevel = to_integer(own.at(RavenField::kSublevel));
  state.last_seq = to_integer(own.at(RavenField::kLastSeq));
  fill_arm(own, state.arm[0]);
  fill_arm(ArmReader(values_si, true), state.arm[1]);
  for (ravencal_arm& arm : state.arm) arm.joints_ready = homed ? 0xFFU : 0U;
}

}  // namespace ravencal::plugin_host
