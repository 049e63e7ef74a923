// SPDX-License-Identifier: Apache-2.0
//
// The format: MathWorks, MAT-File Format, level 5.
#include "exchange/mat_check.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

namespace ravencal::exchange {
namespace {

constexpr std::uint64_t kHeaderBytes = 128;
constexpr std::uint64_t kTagBytes = 8;     // u32 type, u32 bytes
constexpr std::uint32_t kCompressed = 15;  // miCOMPRESSED: a stream of zlib
constexpr std::size_t kBlock = std::size_t{1} << 16U;

std::uint32_t swapped(std::uint32_t value) {
  return (value << 24U) | ((value & 0xFF00U) << 8U) | ((value >> 8U) & 0xFF00U) | (value >> 24U);
}

/// True if a stream of zlib fills the next `bytes` of the file, and is whole.
bool inflates(std::ifstream& file, std::uint64_t bytes) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return false;
  std::vector<char> in(kBlock);
  std::vector<std::uint8_t> out(kBlock);
  int code = Z_OK;
  while (bytes > 0 && code == Z_OK) {
    const std::uint64_t count = std::min<std::uint64_t>(bytes, in.size());
    if (!file.read(in.data(), static_cast<std::streamsize>(count))) break;
    bytes -= count;
    stream.next_in = reinterpret_cast<Bytef*>(in.data());
    stream.avail_in = static_cast<uInt>(count);
    do {
      stream.next_out = out.data();
      stream.avail_out = static_cast<uInt>(out.size());
      code = inflate(&stream, Z_NO_FLUSH);
    } while (code == Z_OK && stream.avail_out == 0);
  }
  (void)inflateEnd(&stream);
  return code == Z_STREAM_END;
}

}  // namespace

core::Status check_mat5(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::uint64_t>(std::max<std::streamoff>(file.tellg(), 0));
  std::array<char, kHeaderBytes> header{};
  file.seekg(0);
  file.read(header.data(), header.size());
  // Written as the number "MI" by the machine that made the file.
  const bool is_big = header[126] == 'M' && header[127] == 'I';
  const auto damaged = [&](std::uint64_t at, std::string_view why) {
    return core::data_error(
        fmt::format("{}: the variable at byte {} of {} {}", path.string(), at, size, why));
  };
  for (std::uint64_t at = kHeaderBytes; at < size;) {
    std::array<std::uint32_t, 2> tag{};
    file.seekg(static_cast<std::streamoff>(at));
    if (!file.read(reinterpret_cast<char*>(tag.data()), sizeof(tag)))
      return damaged(at, "is cut short");
    const bool is_foreign = is_big == (std::endian::native == std::endian::little);
    const std::uint32_t type = is_foreign ? swapped(tag[0]) : tag[0];
    const std::uint32_t bytes = is_foreign ? swapped(tag[1]) : tag[1];
    if (bytes > size - at - kTagBytes) return damaged(at, "is cut short");
    if (type == kCompressed && !inflates(file, bytes)) return damaged(at, "is damaged");
    at += kTagBytes + bytes;
  }
  return {};
}

}  // namespace ravencal::exchange
