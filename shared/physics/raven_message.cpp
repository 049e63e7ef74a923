// SPDX-License-Identifier: Apache-2.0
#include "physics/raven_message.hpp"
#include "core/constants.hpp"

#include <utility>

namespace ravencal::physics {
namespace {

using core::RavenField;

constexpr double kNoPacketYet = 111.0;

double as_float(double value) { return static_cast<double>(static_cast<float>(value)); }

template <typename Values>
void write(RavenField field, bool other_arm, const Values& values, double factor,
           RavenMessage& message) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    message[core::catalogue_index(field, i, other_arm)] =
        as_float(static_cast<double>(values[i]) * factor);
  }
}

template <typename Values>
void write_integers(RavenField field, bool other_arm, const Values& values, RavenMessage& message) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    message[core::catalogue_index(field, i, other_arm)] = static_cast<double>(values[i]);
  }
}

}  // namespace

void write_sensor_fields(const ArmState& arm, bool other_arm, RavenMessage& message) {
  write_integers(RavenField::kEncVals, other_arm, arm.encoder_counts, message);
  write(RavenField::kEncOffsets, other_arm, arm.encoder_offset, 1.0, message);
  write(RavenField::kMpos, other_arm, arm.mpos_rad, core::kDegPerRad, message);
  write(RavenField::kMvel, other_arm, arm.mvel_rad_per_s, core::kDegPerRad, message);
  // The insertion is in metres and gets the same factor.
  write(RavenField::kJpos, other_arm, arm.jpos_ji, core::kDegPerRad, message);
  write(RavenField::kJvel, other_arm, arm.jvel_ji, core::kDegPerRad, message);
}

void write_control_fields(const ArmState& arm, bool other_arm, RavenMessage& message) {
  message[core::catalogue_index(RavenField::kType, 0, other_arm)] = arm.type;
  write_integers(RavenField::kPos, other_arm, arm.pose.position_um, message);
  write(RavenField::kOri, other_arm, arm.pose.rotation, 1.0, message);
  // In joint mode the controller re-seeds the desired pose from the actual one (set_posd_to_pos).
  write_integers(RavenField::kPosD, other_arm, arm.pose.position_um, message);
  write(RavenField::kOriD, other_arm, arm.pose.rotation, 1.0, message);
  write_integers(RavenField::kDac, other_arm, arm.dac, message);
  write(RavenField::kTau, other_arm, arm.tau_n_m, 1.0, message);
  write(RavenField::kMposD, other_arm, arm.mpos_d_rad, core::kDegPerRad, message);
  write(RavenField::kJposD, other_arm, arm.jpos_d_ji, core::kDegPerRad, message);
  message[core::catalogue_index(RavenField::kGraspD, 0, other_arm)] = as_float(arm.grasp_d_rad);
  write(RavenField::kJacVel, other_arm, arm.jacobian_velocity, 1.0, message);
  write(RavenField::kJacF, other_arm, arm.jacobian_velocity, 1.0, message);
}

void swap_mechanism_fields(RavenMessage& message) {
  constexpr std::array kFields = {RavenField::kType,   RavenField::kPos,  RavenField::kOri,
                                  RavenField::kOriD,   RavenField::kPosD, RavenField::kGraspD,
                                  RavenField::kJacVel, RavenField::kJacF};
  for (const RavenField field : kFields) {
    for (std::size_t i = 0; i < core::info_of(field).count; ++i) {
      std::swap(message[core::catalogue_index(field, i)],
                message[core::catalogue_index(field, i, true)]);
    }
  }
}

void write_status_fields(double time_s, int runlevel, int sublevel, RavenMessage& message) {
  message[core::catalogue_index(RavenField::kTime, 0)] = time_s;
  message[core::catalogue_index(RavenField::kRunlevel, 0)] = runlevel;
  message[core::catalogue_index(RavenField::kSublevel, 0)] = sublevel;
  message[core::catalogue_index(RavenField::kLastSeq, 0)] = kNoPacketYet;
}

void clear_dac_fields(RavenMessage& message) {
  for (const bool other_arm : {false, true}) {
    for (std::size_t i = 0; i < core::kSlotCount; ++i) {
      message[core::catalogue_index(RavenField::kDac, i, other_arm)] = 0.0;
    }
  }
}

}  // namespace ravencal::physics
