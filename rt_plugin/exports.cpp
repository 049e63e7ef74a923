// SPDX-License-Identifier: Apache-2.0
//
// The C ABI: checks what the host gives, then calls the C++ inside. Nothing else is exported.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <limits>
#include <new>

#include "core/version.hpp"
#include "ravencal/plugin.h"
#include "rt_plugin/fp_mode.hpp"
#include "rt_plugin/instance.hpp"
#include "rt_plugin/pose.hpp"
#include "rt_plugin/step.hpp"

namespace {

using ravencal::rt::OwnFloatMode;

// Sizes of version 3.0. A host may pass larger structs (a newer header) but never smaller ones.
constexpr std::size_t kStateBytes = sizeof(ravencal_state);
constexpr std::size_t kOutputBytes = offsetof(ravencal_output, desired_ji);
constexpr std::size_t kConfigBytes = offsetof(ravencal_config, lowest_ji);

template <typename Struct>
bool large_enough(const Struct* value) noexcept {
  return value != nullptr && value->struct_size >= sizeof(Struct);
}

const char* version() noexcept { return ravencal::core::kVersion; }

void set_defaults(ravencal_config* config) noexcept {
  config->tick_ns = 1'000'000;
  config->max_isa = RAVENCAL_ISA_BEST;
  config->hold_ns = 20'000'000;
  // Half of the cycle: the other half is the controller's.
  config->step_budget_ns = 500'000;
  config->max_overruns = 3;
  // RE40 motors turn at 7590 rpm without load (Maxon 148877, 60.3 mN m/A), with encoders of 4000
  // counts per turn: 506 in a millisecond. CRTK's clamp of 0.0025 rad/ms asks for 217 of joint 1.
  config->max_encoder_step_counts = 512;
  config->require_signature = 0;
  std::memset(config->public_key, 0, sizeof config->public_key);
  std::memset(config->telemetry_name, 0, sizeof config->telemetry_name);
  // Ten times the speed of the authors' trajectory follower, 2.182 deg/s, 3 deg/s and 5 mm/s
  // (HaonanPeng/raven2_CRTK_Python_controller): hysteresis at a reversal needs it.
  constexpr float kRate[RAVENCAL_JOINTS] = {0.38F, 0.52F, 0.05F};
  // Corrections beyond 11.5 deg or 20 mm are not calibration but a fault.
  constexpr float kLargest[RAVENCAL_JOINTS] = {0.2F, 0.2F, 0.02F};
  // A fade, which moves no motor, takes half a second at most for the largest correction.
  constexpr float kLongestFadeS = 0.5F;
  // An offset shrinks by a tenth of the commanded motion at most, and by half a count of the
  // motor's encoder per tick: 2 pi / 4000 rad of the motor / 136.196, 121.522 and 2158.59 rad/m
  // (RAVEN-II's reductions), halved.
  constexpr float kBlend[RAVENCAL_JOINTS] = {0.00577F, 0.00646F, 0.000364F};
  config->blend_share = 0.1F;
  // The motors are then led at most 1.1 times as fast as the joints are commanded to move, whatever
  // the network answers to the motor command that it causes.
  config->follow_share = 0.1F;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    config->slew_ji_per_s[j] = std::max(kRate[j], kLargest[j] / kLongestFadeS);
    config->max_correction_rate_ji_per_s[j] = kRate[j];
    config->max_correction_ji[j] = kLargest[j];
    config->blend_ji_per_s[j] = kBlend[j];
  }
  config->arm = RAVENCAL_ARM_ANY;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    config->lowest_ji[j] = -std::numeric_limits<float>::max();
    config->highest_ji[j] = std::numeric_limits<float>::max();
  }
  config->remote_centre_m = 0.0F;
  config->remote_centre_radius_m = 0.0F;
  config->resume_after_stop = 0;
  config->joint_mask = (1U << RAVENCAL_JOINTS) - 1U;
  config->share = 1.0F;
  // At most one error in 16 lies so far from the mean, whatever its distribution is (Chebyshev),
  // and of a normal one in 16 000: what the network asks for beyond it was not in its training.
  config->cap_deviations = 4.0F;
}

/// Copies what both know, all but struct_size.
void copy_config(const ravencal_config& from, std::uint32_t host_size,
                 ravencal_config& to) noexcept {
  constexpr std::size_t kFirst = sizeof from.struct_size;
  const std::size_t known = std::min<std::size_t>(host_size, sizeof from);
  std::memcpy(reinterpret_cast<char*>(&to) + kFirst, reinterpret_cast<const char*>(&from) + kFirst,
              known - kFirst);
}

/// What hosts get that were built before there was a choice.
void as_before_3_2(ravencal_config& config) noexcept {
  config.resume_after_stop = 1;
  config.cap_deviations = 0.0F;
}

std::int32_t default_config(ravencal_config* config) noexcept {
  if (config == nullptr || config->struct_size < kConfigBytes) return RAVENCAL_ERROR_ARGUMENT;
  ravencal_config defaults{};
  set_defaults(&defaults);
  copy_config(defaults, config->struct_size, *config);
  return RAVENCAL_SUCCESS;
}

bool is_positive(const float (&values)[RAVENCAL_JOINTS]) noexcept {
  for (const float value : values) {
    if (!(value > 0.0F) || !std::isfinite(value)) return false;
  }
  return true;
}

bool is_range(const ravencal_config& config) noexcept {
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    if (!(config.lowest_ji[j] < config.highest_ji[j])) return false;
  }
  return config.remote_centre_radius_m >= 0.0F && std::isfinite(config.remote_centre_radius_m) &&
         std::isfinite(config.remote_centre_m);
}

bool is_share(float value) noexcept { return value >= 0.0F && value <= 1.0F; }
bool is_mask(std::uint32_t joints) noexcept { return joints < 1U << RAVENCAL_JOINTS; }

bool is_valid(const ravencal_config& config) noexcept {
  constexpr std::uint32_t kShortestTickNs = 10'000;
  constexpr std::uint32_t kLongestTickNs = 100'000'000;
  constexpr std::uint32_t kLongestHoldNs = 1'000'000'000;
  const bool countable =
      config.max_overruns >= 1 && config.max_overruns <= ravencal::rt::OverrunWatch::kMostOverruns;
  return config.tick_ns >= kShortestTickNs && config.tick_ns <= kLongestTickNs &&
         config.hold_ns <= kLongestHoldNs && (countable || config.step_budget_ns == 0) &&
         config.max_isa <= RAVENCAL_ISA_NEON && config.arm <= RAVENCAL_ARM_GREEN &&
         is_range(config) && is_share(config.share) && is_mask(config.joint_mask) &&
         config.cap_deviations >= 0.0F && is_share(config.blend_share) &&
         is_share(config.follow_share) && is_positive(config.blend_ji_per_s) &&
         is_positive(config.slew_ji_per_s) && is_positive(config.max_correction_ji) &&
         is_positive(config.max_correction_rate_ji_per_s);
}

std::size_t storage_size() noexcept { return sizeof(ravencal_instance); }
std::size_t storage_alignment() noexcept { return alignof(ravencal_instance); }

std::int32_t create(const ravencal_config* config, void* storage, std::size_t storage_bytes,
                    ravencal_instance** instance) noexcept {
  const OwnFloatMode own_mode;
  if (instance == nullptr || storage == nullptr || config == nullptr ||
      config->struct_size < kConfigBytes) {
    return RAVENCAL_ERROR_ARGUMENT;
  }
  ravencal_config settings{};
  set_defaults(&settings);
  settings.struct_size = sizeof settings;
  copy_config(*config, config->struct_size, settings);
  if (config->struct_size < offsetof(ravencal_config, share)) as_before_3_2(settings);
  if (!is_valid(settings)) return RAVENCAL_ERROR_ARGUMENT;
  const bool misaligned = reinterpret_cast<std::uintptr_t>(storage) % storage_alignment() != 0;
  if (storage_bytes < storage_size() || misaligned) return RAVENCAL_ERROR_MEMORY;
  auto* const made = new (storage) ravencal_instance(settings);
  const std::int32_t code = made->telemetry.open(made->config);
  if (code == RAVENCAL_SUCCESS) {
    made->requests.begin(made->telemetry.start_realtime_ns());
    *instance = made;
  } else {
    made->~ravencal_instance();
  }
  return code;
}

std::int32_t load(ravencal_instance* instance, const char* path) noexcept {
  if (instance == nullptr || path == nullptr) return RAVENCAL_ERROR_ARGUMENT;
  const OwnFloatMode own_mode;
  instance->last_load = {};
  ravencal::rt::LoadedModel* const model =
      ravencal::rt::load_model(path, instance->config, instance->last_load);
  if (model == nullptr) return instance->last_load.code;
  instance->loaded = model->info();
  instance->swap.offer(model);
  return RAVENCAL_SUCCESS;
}

const char* last_error(const ravencal_instance* instance) noexcept {
  return instance == nullptr ? "no instance" : instance->last_load.message.data();
}

void enable(ravencal_instance* instance, std::int32_t on) noexcept {
  if (instance == nullptr) return;
  instance->operation.set_mode(on != 0 ? RAVENCAL_MODE_ARM : RAVENCAL_MODE_OFF);
}

std::int32_t set_mode(ravencal_instance* instance, std::int32_t mode) noexcept {
  if (instance == nullptr || mode < RAVENCAL_MODE_OFF || mode > RAVENCAL_MODE_SHADOW) {
    return RAVENCAL_ERROR_ARGUMENT;
  }
  instance->operation.set_mode(mode);
  return RAVENCAL_SUCCESS;
}

std::int32_t set_share(ravencal_instance* instance, float share, std::uint32_t joints) noexcept {
  if (instance == nullptr || !is_share(share) || !is_mask(joints)) return RAVENCAL_ERROR_ARGUMENT;
  instance->operation.set_share(share, joints);
  return RAVENCAL_SUCCESS;
}

std::int32_t set_homing_constant(ravencal_instance* instance,
                                 const ravencal_homing_constant* constant) noexcept {
  if (instance == nullptr) return RAVENCAL_ERROR_ARGUMENT;
  const OwnFloatMode own_mode;
  const bool ends = constant == nullptr;
  const auto most_ji = std::to_array(instance->config.max_correction_ji);
  if (!ends &&
      (!large_enough(constant) || !ravencal::rt::HomingConstant::is_within(*constant, most_ji))) {
    return RAVENCAL_ERROR_ARGUMENT;
  }
  instance->homing_constant.offer(ends ? ravencal_homing_constant{} : *constant);
  return RAVENCAL_SUCCESS;
}

std::int32_t info(const ravencal_instance* instance, ravencal_info* result) noexcept {
  if (instance == nullptr || !large_enough(result) || instance->loaded.struct_size == 0) {
    return RAVENCAL_ERROR_ARGUMENT;
  }
  const std::uint32_t host_size = result->struct_size;
  *result = instance->loaded;
  result->struct_size = host_size;
  return RAVENCAL_SUCCESS;
}

std::int32_t step(ravencal_instance* instance, const ravencal_state* state,
                  ravencal_output* output) noexcept {
  if (instance == nullptr || state == nullptr || output == nullptr ||
      state->struct_size < kStateBytes || output->struct_size < kOutputBytes) {
    return RAVENCAL_ERROR_ARGUMENT;
  }
  const OwnFloatMode own_mode;
  return ravencal::rt::step(*instance, *state, *output);
}

void uncorrect_desired(const ravencal_instance* instance, const float desired_ji[RAVENCAL_JOINTS],
                       float uncorrected_ji[RAVENCAL_JOINTS]) noexcept {
  if (instance == nullptr || desired_ji == nullptr || uncorrected_ji == nullptr) return;
  const OwnFloatMode own_mode;
  const ravencal::rt::JointVector motor_ji = instance->desired.motor_side_ji(
      {desired_ji[0], desired_ji[1], desired_ji[2]}, instance->envelope.correction_ji());
  std::copy(motor_ji.begin(), motor_ji.end(), uncorrected_ji);
}

void uncorrect_command(ravencal_instance* instance, const float desired_ji[RAVENCAL_JOINTS],
                       std::int32_t /*commanded*/, float uncorrected_ji[RAVENCAL_JOINTS]) noexcept {
  if (instance == nullptr || desired_ji == nullptr || uncorrected_ji == nullptr) return;
  const OwnFloatMode own_mode;
  const ravencal::rt::JointVector motor_ji =
      ravencal::rt::motor_command_ji(*instance, {desired_ji[0], desired_ji[1], desired_ji[2]});
  std::copy(motor_ji.begin(), motor_ji.end(), uncorrected_ji);
}

void uncorrect_pose(const ravencal_instance* instance, const float corrected_ji[RAVENCAL_JOINTS],
                    const float uncorrected_ji[RAVENCAL_JOINTS], std::int32_t position_um[3],
                    float rotation[9]) noexcept {
  if (instance == nullptr || corrected_ji == nullptr || uncorrected_ji == nullptr ||
      position_um == nullptr || rotation == nullptr || instance->config.arm == RAVENCAL_ARM_ANY) {
    return;
  }
  const OwnFloatMode own_mode;
  const ravencal::core::ArmGeometry& arm = instance->config.arm == RAVENCAL_ARM_GOLD
                                               ? ravencal::core::kGoldGeometry
                                               : ravencal::core::kGreenGeometry;
  ravencal::rt::move_pose(arm, corrected_ji, uncorrected_ji, position_um, rotation);
}

void observe_cycle_end(ravencal_instance* instance, const ravencal_state* state) noexcept {
  if (instance == nullptr || state == nullptr || state->struct_size < kStateBytes) return;
  const OwnFloatMode own_mode;
  ravencal::rt::observe_cycle_end(*instance, *state);
}

std::int32_t counters(const ravencal_instance* instance, ravencal_counters* result) noexcept {
  if (instance == nullptr || !large_enough(result)) return RAVENCAL_ERROR_ARGUMENT;
  const std::uint32_t host_size = result->struct_size;
  *result = instance->shared_counters.read();
  result->struct_size = host_size;
  return RAVENCAL_SUCCESS;
}

void reset(ravencal_instance* instance) noexcept {
  if (instance == nullptr) return;
  instance->operation.reset();
}

std::int32_t flight(const ravencal_instance* instance, ravencal_flight* result) noexcept {
  if (instance == nullptr || !large_enough(result)) return RAVENCAL_ERROR_ARGUMENT;
  return instance->flight.copy(*result) ? RAVENCAL_SUCCESS : RAVENCAL_ERROR_ARGUMENT;
}

void destroy(ravencal_instance* instance) noexcept {
  if (instance == nullptr) return;
  instance->swap.clear();
  instance->models.clear();
  instance->~ravencal_instance();
}

constexpr ravencal_api kApi = {
    sizeof(ravencal_api),
    RAVENCAL_ABI_MAJOR,
    RAVENCAL_ABI_MINOR,
    0,
    &version,
    &default_config,
    &storage_size,
    &storage_alignment,
    &create,
    &load,
    &last_error,
    &enable,
    &info,
    &step,
    &uncorrect_desired,
    &uncorrect_pose,
    &observe_cycle_end,
    &counters,
    &reset,
    &flight,
    &destroy,
    &uncorrect_command,
    &set_mode,
    &set_share,
    &set_homing_constant,
};

}  // namespace

extern "C" __attribute__((visibility("default"))) const ravencal_api* ravencal_plugin_entry(
    uint32_t host_abi_major) {
  return host_abi_major == RAVENCAL_ABI_MAJOR ? &kApi : nullptr;
}
