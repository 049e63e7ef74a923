// SPDX-License-Identifier: Apache-2.0
//
// Verifies a blob's signature (Ed25519, RFC 8032). The plugin and the tools use the same code: no
// exceptions, no allocation, no state; about 10 ms per megabyte. Any thread but a real-time one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "model/blob_view.hpp"

namespace ravencal::model {

inline constexpr std::size_t kPublicKeyBytes = 32;

enum class SignatureStatus : std::uint8_t {
  kValid,    ///< signed with the secret half of the key, and unchanged since
  kMissing,  ///< the blob is not signed
  kWrong,    ///< signed by another key, or changed after it was signed
};

SignatureStatus verify_signature(
    const BlobView& blob, std::span<const std::uint8_t, kPublicKeyBytes> public_key) noexcept;

}  // namespace ravencal::model
