// SPDX-License-Identifier: Apache-2.0
//
// The three helpers of libsodium that its Ed25519 verification calls, by their own names, so that
// the linker takes verification and SHA-512 alone from libsodium.a. Its own file of helpers also
// links random numbers and locked memory, and with them malloc, mutexes and symbols of glibc 2.25
// and 2.33, which old robot computers lack. Verification has no secrets, so these need not be
// constant-time; they have the contracts of libsodium's utils.h.
#include <cstddef>

extern "C" {

void sodium_memzero(void* memory, std::size_t size);
int sodium_is_zero(const unsigned char* bytes, std::size_t size);
int sodium_memcmp(const void* a, const void* b, std::size_t size);

void sodium_memzero(void* memory, std::size_t size) {
  auto* const bytes = static_cast<volatile unsigned char*>(memory);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = 0;
}

/// 1 if all are zero, else 0.
int sodium_is_zero(const unsigned char* bytes, std::size_t size) {
  unsigned char any = 0;
  for (std::size_t i = 0; i < size; ++i) any = static_cast<unsigned char>(any | bytes[i]);
  return any == 0 ? 1 : 0;
}

/// 0 if they are equal, else -1.
int sodium_memcmp(const void* a, const void* b, std::size_t size) {
  const auto* const left = static_cast<const unsigned char*>(a);
  const auto* const right = static_cast<const unsigned char*>(b);
  unsigned char differ = 0;
  for (std::size_t i = 0; i < size; ++i) {
    differ = static_cast<unsigned char>(differ | (left[i] ^ right[i]));
  }
  return differ == 0 ? 0 : -1;
}
}
