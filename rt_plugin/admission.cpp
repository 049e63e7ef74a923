// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/admission.hpp"

#include <cstddef>
#include <cstdint>

#include "model/blob_signature.hpp"

namespace ravencal::rt {
namespace {

using model::BlobView;

static_assert(static_cast<std::uint32_t>(model::Arm::kUnknown) == RAVENCAL_ARM_ANY &&
              static_cast<std::uint32_t>(model::Arm::kGold) == RAVENCAL_ARM_GOLD &&
              static_cast<std::uint32_t>(model::Arm::kGreen) == RAVENCAL_ARM_GREEN);
static_assert(static_cast<std::uint32_t>(model::Coordinates::kMotor) ==
                  RAVENCAL_COORDINATES_MOTOR &&
              static_cast<std::uint32_t>(model::Coordinates::kCorrected) ==
                  RAVENCAL_COORDINATES_CORRECTED);

bool has_key(const ravencal_config& config) noexcept {
  for (const std::uint8_t byte : config.public_key) {
    if (byte != 0) return true;
  }
  return false;
}

/// With a key, a signature must be right; without one, it need not be there unless required.
bool admit_signature(const BlobView& blob, const char* path, const ravencal_config& config,
                     LoadFailure& failure) noexcept {
  const bool required = config.require_signature != 0;
  if (!required && !is_signature_checked(blob, config)) return true;
  if (!has_key(config)) {
    failure.say(RAVENCAL_ERROR_TRUST,
                "%s: a signature is required, but no public key is configured", path);
    return false;
  }
  switch (verify_signature(blob, config.public_key)) {
    case model::SignatureStatus::kValid:
      return true;
    case model::SignatureStatus::kMissing:
      failure.say(RAVENCAL_ERROR_TRUST,
                  "%s: is not signed, and a signature is required: ravencal sign", path);
      return false;
    default:
      failure.say(RAVENCAL_ERROR_TRUST,
                  "%s: is signed by another key, or was changed after it was signed", path);
      return false;
  }
}

const char* name_of_arm(std::uint32_t arm) noexcept {
  return arm == RAVENCAL_ARM_GOLD ? "gold" : "green";
}

/// Weights of another arm correct wrongly with full confidence. Weights trained on corrected joints
/// learned what another correction had left of the error, not the error.
bool admit_origin(const BlobView& blob, const char* path, const ravencal_config& config,
                  LoadFailure& failure) noexcept {
  if (blob.coordinates() == model::Coordinates::kCorrected) {
    failure.say(RAVENCAL_ERROR_ORIGIN,
                "%s: was trained on recordings whose joints were already corrected; train on "
                "recordings made while the plugin was disabled",
                path);
    return false;
  }
  const auto arm = static_cast<std::uint32_t>(blob.arm());
  if (config.arm == RAVENCAL_ARM_ANY || config.arm == arm) return true;
  if (arm == RAVENCAL_ARM_ANY) {
    failure.say(RAVENCAL_ERROR_ORIGIN,
                "%s: does not say which arm it was trained for; if that is the %s arm, convert it "
                "again with --arm %s",
                path, name_of_arm(config.arm), name_of_arm(config.arm));
  } else {
    failure.say(RAVENCAL_ERROR_ORIGIN,
                "%s: was trained for the %s arm and would correct the %s one", path,
                name_of_arm(arm), name_of_arm(config.arm));
  }
  return false;
}

bool admit_outputs(const BlobView& blob, const char* path, LoadFailure& failure) noexcept {
  if (blob.output_count() > RAVENCAL_JOINTS) {
    failure.say(RAVENCAL_ERROR_TOPOLOGY,
                "%s: corrects %u joints; the robot state has %d to correct", path,
                static_cast<unsigned>(blob.output_count()), RAVENCAL_JOINTS);
    return false;
  }
  for (std::size_t j = 0; j < blob.output_count(); ++j) {
    const model::BlobOutput output = blob.output(j);
    if (output.slot >= RAVENCAL_JOINTS) {
      failure.say(RAVENCAL_ERROR_FEATURES, "%s: corrects '%.*s', which is not joint 1, 2 or 3",
                  path, static_cast<int>(output.joint.size()), output.joint.data());
      return false;
    }
  }
  return true;
}

}  // namespace

bool admit(const BlobView& blob, const char* path, const ravencal_config& config,
           LoadFailure& failure) noexcept {
  return admit_signature(blob, path, config, failure) &&
         admit_origin(blob, path, config, failure) && admit_outputs(blob, path, failure);
}

bool is_signature_checked(const BlobView& blob, const ravencal_config& config) noexcept {
  return has_key(config) && (blob.is_signed() || config.require_signature != 0);
}

}  // namespace ravencal::rt
