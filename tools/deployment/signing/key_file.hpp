// SPDX-License-Identifier: Apache-2.0
//
// Ed25519 keys as files of one line: `ravencal-secret-key-ed25519 HEX` (the 32-byte seed) and
// `ravencal-public-key-ed25519 HEX` (32 bytes, what ravencal_config.public_key holds).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/result.hpp"

namespace ravencal::signing {

using PublicKey = std::array<std::uint8_t, 32>;

/// Overwritten when it goes.
class SecretKey {
 public:
  using Seed = std::array<std::uint8_t, 32>;
  explicit SecretKey(const Seed& seed);
  ~SecretKey();
  SecretKey(const SecretKey& other) = default;
  SecretKey& operator=(const SecretKey& other) = default;

  [[nodiscard]] const std::array<std::uint8_t, 64>& bytes() const { return bytes_; }
  [[nodiscard]] PublicKey public_key() const;

 private:
  std::array<std::uint8_t, 64> bytes_{};
};

/// 64 lower-case digits.
std::string hex(const PublicKey& key);

/// Makes a key of the system's random numbers, writes `path` (mode 0600) and `path`.pub, and
/// returns the public half. Errors (kIo): a file of either name exists, or cannot be written; then
/// neither is left.
core::Result<PublicKey> generate_key(const std::filesystem::path& path);

/// Errors: kIo, it cannot be read; kData, it is not a secret key, or others may read or write it.
core::Result<SecretKey> read_secret_key(const std::filesystem::path& path);
/// Errors: kIo, it cannot be read; kData, it is not a public key.
core::Result<PublicKey> read_public_key(const std::filesystem::path& path);

}  // namespace ravencal::signing
