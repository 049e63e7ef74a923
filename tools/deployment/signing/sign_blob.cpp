// SPDX-License-Identifier: Apache-2.0
#include "signing/sign_blob.hpp"

#include <fmt/format.h>
#include <sodium.h>

#include <cstring>

#include "model/blob_view.hpp"

namespace ravencal::signing {
namespace {

using namespace model::blob;

void put_u32(std::byte* at, std::uint32_t value) {
  for (unsigned i = 0; i < 4; ++i) at[i] = static_cast<std::byte>((value >> (8 * i)) & 0xFFU);
}

core::Status check(const std::vector<std::byte>& blob, std::string_view source) {
  model::BlobView view;
  const model::BlobCheck result = model::BlobView::open(blob, view);
  if (result.ok()) return {};
  return core::Error{core::ErrorCode::kData, fmt::format("{}: {} (byte {})", source,
                                                         describe(result.status), result.offset)};
}

}  // namespace

core::Status sign_blob(std::vector<std::byte>& blob, const SecretKey& key,
                       std::string_view source) {
  RAVENCAL_RETURN_IF_ERROR(check(blob, source));
  std::byte* const trailer = blob.data() + blob.size() - kTrailerBytes;
  put_u32(trailer + kSignatureKindAt, kEd25519);
  std::byte* const signature = trailer + kSignatureAt;
  crypto_sign_ed25519_detached(reinterpret_cast<unsigned char*>(signature), nullptr,
                               reinterpret_cast<const unsigned char*>(blob.data()),
                               static_cast<std::size_t>(signature - blob.data()),
                               key.bytes().data());
  put_u32(trailer + kSignatureChecksumAt, crc32c(signature, kSignatureBytes));
  return check(blob, source);
}

}  // namespace ravencal::signing
