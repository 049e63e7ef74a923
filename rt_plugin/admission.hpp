// SPDX-License-Identifier: Apache-2.0
//
// Whether a valid blob may correct this robot: who signed it, for which arm it was trained and in
// which coordinates, and which joints it corrects. Not for the real-time thread.
#pragma once

#include "model/blob_view.hpp"
#include "ravencal/plugin.h"
#include "rt_plugin/load_failure.hpp"

namespace ravencal::rt {

/// [init] False: `failure` says why not; its sentence begins with `path`.
bool admit(const model::BlobView& blob, const char* path, const ravencal_config& config,
           LoadFailure& failure) noexcept;

/// Of an admitted blob: whether its signature was there and was checked.
bool is_signature_checked(const model::BlobView& blob, const ravencal_config& config) noexcept;

}  // namespace ravencal::rt
