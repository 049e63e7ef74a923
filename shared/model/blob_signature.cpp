// SPDX-License-Identifier: Apache-2.0
#include "model/blob_signature.hpp"

#include <sodium/crypto_sign_ed25519.h>

namespace ravencal::model {

static_assert(kPublicKeyBytes == crypto_sign_ed25519_PUBLICKEYBYTES);
static_assert(blob::kSignatureBytes == crypto_sign_ed25519_BYTES);

SignatureStatus verify_signature(
    const BlobView& blob, std::span<const std::uint8_t, kPublicKeyBytes> public_key) noexcept {
  if (!blob.is_signed()) return SignatureStatus::kMissing;
  const auto bytes_of = [](std::span<const std::byte> span) {
    return reinterpret_cast<const unsigned char*>(span.data());
  };
  const int result =
      crypto_sign_ed25519_verify_detached(bytes_of(blob.signature()), bytes_of(blob.signed_bytes()),
                                          blob.signed_bytes().size(), public_key.data());
  return result == 0 ? SignatureStatus::kValid : SignatureStatus::kWrong;
}

}  // namespace ravencal::model
