// SPDX-License-Identifier: Apache-2.0
//
// Commitments that make the proof blind: a hash fixes the content of a case before the run, and
// another one the report of diagnose before the cases are opened. Hashes are lower-case hex
// SHA-256.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::prove {

std::string sha256(std::string_view bytes);
/// Errors: kIo.
core::Result<std::string> sha256_of_file(const std::filesystem::path& path);

/// 32 random bytes of the operating system, in hex.
std::string fresh_nonce();

/// SHA-256 of the nonce's bytes followed by the manifest: binds, and hides until both are shown.
std::string commitment(std::string_view nonce_hex, std::string_view manifest);

/// Root over leaves in their order: leaf = H(0 | commitment), node = H(1 | left | right); an odd
/// last node moves up as it is (RFC 6962). Empty: H of nothing.
std::string merkle_root(const std::vector<std::string>& commitments);

}  // namespace ravencal::prove
