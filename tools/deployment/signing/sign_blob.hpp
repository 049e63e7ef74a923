// SPDX-License-Identifier: Apache-2.0
//
// Puts a signature into a blob. model/blob_signature.hpp verifies it.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "signing/key_file.hpp"

namespace ravencal::signing {

/// Signs the blob in place; an earlier signature is replaced. Errors (kData): it is not a valid
/// blob; the sentence names `source`.
core::Status sign_blob(std::vector<std::byte>& blob, const SecretKey& key, std::string_view source);

}  // namespace ravencal::signing
