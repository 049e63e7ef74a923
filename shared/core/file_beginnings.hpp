// SPDX-License-Identifier: Apache-2.0
//
// By which of its bytes a file of the project is known: to its format, which writes them, and to
// the owner of outputs, which replaces no key.
#pragma once

#include <cstddef>
#include <string_view>

namespace ravencal::core {

/// Before the digits of a key.
inline constexpr std::string_view kSecretKeyLabel = "ravencal-secret-key-ed25519 ";
inline constexpr std::string_view kPublicKeyLabel = "ravencal-public-key-ed25519 ";

/// SQLite's application_id of a recording, so that file(1) can tell, and where SQLite has it.
inline constexpr std::string_view kRecordingId = "RVCL";
inline constexpr std::size_t kRecordingIdAt = 68;

}  // namespace ravencal::core
