// SPDX-License-Identifier: Apache-2.0
#include "prove/seal.hpp"

#include <sodium.h>

#include <array>

#include "core/whole_file.hpp"

namespace ravencal::prove {
namespace {

std::string hex(const unsigned char* bytes, std::size_t count) {
  std::string text(2 * count + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes, count);
  text.pop_back();
  return text;
}

std::string bytes_of(std::string_view text) {
  std::string bytes(text.size() / 2, '\0');
  std::size_t used = 0;
  if (sodium_hex2bin(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), text.data(),
                     text.size(), nullptr, &used, nullptr) != 0) {
    used = 0;
  }
  bytes.resize(used);
  return bytes;
}

}  // namespace

std::string sha256(std::string_view bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
  crypto_hash_sha256(digest.data(), reinterpret_cast<const unsigned char*>(bytes.data()),
                     bytes.size());
  return hex(digest.data(), digest.size());
}

core::Result<std::string> sha256_of_file(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string bytes, core::read_whole_file(path));
  return sha256(bytes);
}

std::string fresh_nonce() {
  if (sodium_init() < 0) return {};  // never on Linux: the system has a source of randomness
  std::array<unsigned char, 32> nonce{};
  randombytes_buf(nonce.data(), nonce.size());
  return hex(nonce.data(), nonce.size());
}

std::string commitment(std::string_view nonce_hex, std::string_view manifest) {
  return sha256(bytes_of(nonce_hex) + std::string(manifest));
}

std::string merkle_root(const std::vector<std::string>& commitments) {
  if (commitments.empty()) return sha256("");
  std::vector<std::string> level;
  for (const std::string& leaf : commitments)
    level.push_back(sha256(std::string(1, '\0') + bytes_of(leaf)));
  while (level.size() > 1) {
    std::vector<std::string> above;
    for (std::size_t i = 0; i + 1 < level.size(); i += 2)
      above.push_back(sha256('\1' + bytes_of(level[i]) + bytes_of(level[i + 1])));
    if (level.size() % 2 == 1) above.push_back(level.back());
    level = std::move(above);
  }
  return level.front();
}

}  // namespace ravencal::prove
