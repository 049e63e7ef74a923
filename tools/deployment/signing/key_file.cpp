// SPDX-License-Identifier: Apache-2.0
#include "signing/key_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "core/file_beginnings.hpp"
#include "core/whole_file.hpp"

namespace ravencal::signing {
namespace {

using Bytes32 = std::array<std::uint8_t, 32>;

std::string hex_of(const Bytes32& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

/// A new file of that mode, synced. Errors: it exists, or cannot be written; then it is removed.
core::Status create_file(const std::filesystem::path& path, const std::string& text, mode_t mode) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) {
    return core::io_error(fmt::format(
        "{}: {}", path.string(),
        errno == EEXIST ? "exists already; a key is never overwritten" : std::strerror(errno)));
  }
  const bool written =
      ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
      ::fsync(file) == 0;
  const int error = errno;
  ::close(file);
  if (written) return {};
  ::unlink(path.c_str());
  return core::io_error(
      fmt::format("{}: cannot be written: {}", path.string(), std::strerror(error)));
}

core::Result<Bytes32> parse(const std::filesystem::path& path, std::string_view label) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  Bytes32 key{};
  std::size_t length = 0;
  const bool labelled = std::string_view(text).substr(0, label.size()) == label;
  const std::size_t digits = label.size() + 2 * key.size();
  const bool sized = text.size() == digits || (text.size() == digits + 1 && text.back() == '\n');
  if (!labelled || !sized ||
      sodium_hex2bin(key.data(), key.size(), text.data() + label.size(), 2 * key.size(), nullptr,
                     &length, nullptr) != 0 ||
      length != key.size()) {
    return core::data_error(fmt::format("{}: is not a key: one line '{}' and 64 hexadecimal digits",
                                        path.string(), label));
  }
  return key;
}

}  // namespace

SecretKey::SecretKey(const Seed& seed) {
  PublicKey unused{};
  crypto_sign_ed25519_seed_keypair(unused.data(), bytes_.data(), seed.data());
}

SecretKey::~SecretKey() { sodium_memzero(bytes_.data(), bytes_.size()); }

PublicKey SecretKey::public_key() const {
  PublicKey key{};
  crypto_sign_ed25519_sk_to_pk(key.data(), bytes_.data());
  return key;
}

std::string hex(const PublicKey& key) { return hex_of(key); }

core::Result<PublicKey> generate_key(const std::filesystem::path& path) {
  if (sodium_init() < 0) return core::io_error("the system gives no random numbers");
  SecretKey::Seed seed{};
  randombytes_buf(seed.data(), seed.size());
  const SecretKey key(seed);
  const std::string secret_line = fmt::format("{}{}\n", core::kSecretKeyLabel, hex_of(seed));
  sodium_memzero(seed.data(), seed.size());
  RAVENCAL_RETURN_IF_ERROR(create_file(path, secret_line, S_IRUSR | S_IWUSR));
  const core::Status status =
      create_file(path.string() + ".pub",
                  fmt::format("{}{}\n", core::kPublicKeyLabel, hex(key.public_key())), 0644);
  if (!status.ok()) {
    ::unlink(path.c_str());
    return status.error();
  }
  return key.public_key();
}

core::Result<SecretKey> read_secret_key(const std::filesystem::path& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) {
    return core::io_error(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  }
  const unsigned mode = static_cast<unsigned>(status.st_mode) & 07777U;
  if ((mode & 077U) != 0) {
    return core::data_error(
        fmt::format("{}: mode {:04o} lets others use this secret key; if nobody did: chmod 600 {}",
                    path.string(), mode, path.string()));
  }
  RAVENCAL_ASSIGN_OR_RETURN(const SecretKey::Seed seed, parse(path, core::kSecretKeyLabel));
  return SecretKey(seed);
}

core::Result<PublicKey> read_public_key(const std::filesystem::path& path) {
  return parse(path, core::kPublicKeyLabel);
}

}  // namespace ravencal::signing
