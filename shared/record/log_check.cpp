// SPDX-License-Identifier: Apache-2.0
#include "record/log_check.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <string>
#include <string_view>

#include "core/whole_file.hpp"

// The formats are those of https://www.sqlite.org/fileformat2.html, sections 1.6, 2.1 and 4.1.
namespace ravencal::record {
namespace {

using Bytes = std::string_view;

constexpr std::size_t kLogHeader = 32;
constexpr std::size_t kFrameHeader = 24;
constexpr std::uint32_t kMagic = 0x377f0682;  // its last bit: checksums of big-endian words
constexpr unsigned char kTableLeaf = 0x0d;

std::uint32_t byte_at(Bytes bytes, std::size_t at) {
  return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0U;
}

std::uint32_t big_endian(Bytes bytes, std::size_t at, std::size_t count = 4) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | byte_at(bytes, at + i);
  return value;
}

/// Cumulative over pairs of 32-bit words.
struct Checksum {
  std::uint32_t first = 0, second = 0;
  bool is_big_endian = false;

  void add(Bytes bytes) {
    for (std::size_t at = 0; at + 8 <= bytes.size(); at += 8) {
      first += word(bytes, at) + second;
      second += word(bytes, at + 4) + first;
    }
  }
  [[nodiscard]] bool is_at(Bytes bytes, std::size_t at) const {
    return first == big_endian(bytes, at) && second == big_endian(bytes, at + 4);
  }

 private:
  [[nodiscard]] std::uint32_t word(Bytes bytes, std::size_t at) const {
    const std::uint32_t value = big_endian(bytes, at);
    return is_big_endian ? value : __builtin_bswap32(value);
  }
};

/// Reads a variable-length integer and moves `at` behind it.
std::uint64_t varint(Bytes page, std::size_t& at) {
  std::uint64_t value = 0;
  for (int i = 0; i < 9; ++i) {
    const std::uint32_t byte = byte_at(page, at++);
    if (i == 8) return value << 8U | byte;
    value = value << 7U | (byte & 0x7fU);
    if (byte < 0x80U) break;
  }
  return value;
}

/// Number of the last row of a page, if its rows have so many columns; else 0.
std::int64_t last_row_of(Bytes page, std::size_t columns) {
  const std::uint32_t cells = big_endian(page, 3, 2);
  if (byte_at(page, 0) != kTableLeaf || cells == 0) return 0;
  std::size_t at = big_endian(page, 8 + 2 * (std::size_t{cells} - 1), 2);
  (void)varint(page, at);  // length of the row
  const auto row = static_cast<std::int64_t>(varint(page, at));
  const std::size_t begin = at;
  const std::uint64_t size = varint(page, at);
  std::size_t count = 0;
  for (; at < begin + std::min<std::uint64_t>(size, page.size()); ++count) (void)varint(page, at);
  return count == columns ? row : 0;
}

/// In bytes, as the header of a database says it; SQLite's default where the file is shorter.
std::size_t page_size_of(const std::filesystem::path& database) {
  constexpr std::size_t kAt = 16;
  std::array<char, kAt + 2> header{};
  std::ifstream file(database, std::ios::binary);
  if (!file.read(header.data(), header.size())) return 4096;
  const std::uint32_t size = big_endian(Bytes(header.data(), header.size()), kAt, 2);
  return size == 1 ? 65536 : std::max<std::size_t>(size, 512);
}

/// `database_page` is the size of a page where the log's own header is damaged.
std::optional<LogDamage> find_damage(Bytes log, std::size_t database_page, std::size_t columns) {
  if (log.size() < kLogHeader + kFrameHeader) return {};
  Checksum checksum;
  checksum.is_big_endian = (big_endian(log, 0) & 1U) != 0;
  checksum.add(log.substr(0, 24));
  bool is_sound = (big_endian(log, 0) & ~1U) == kMagic && checksum.is_at(log, 24);
  const std::size_t page_size = is_sound ? big_endian(log, 8) : database_page;
  // Salts say which frames belong to the log and which are left from an earlier one.
  const Bytes salts = log.substr(is_sound ? 16 : kLogHeader + 8, 8);
  LogDamage damage;
  bool commits_behind = false;
  const std::size_t step = kFrameHeader + page_size;
  for (std::size_t i = 1, at = kLogHeader; at + step <= log.size(); ++i, at += step) {
    const Bytes frame = log.substr(at, step);
    const bool belongs = frame.substr(8, 8) == salts;
    if (is_sound) {
      checksum.add(frame.substr(0, 8));
      checksum.add(frame.substr(kFrameHeader));
      if (belongs && checksum.is_at(frame, 16)) continue;
      is_sound = false;
      damage.frame = static_cast<std::int64_t>(i);
    } else if (belongs && big_endian(frame, 4) != 0) {
      commits_behind = true;
    }
    if (belongs)
      damage.last_row = std::max(damage.last_row, last_row_of(frame.substr(kFrameHeader), columns));
  }
  return commits_behind ? std::optional(damage) : std::nullopt;
}

}  // namespace

core::Result<std::optional<LogDamage>> find_log_damage(const std::filesystem::path& path,
                                                       std::size_t columns) {
  const std::filesystem::path log = path.string() + "-wal";
  std::optional<LogDamage> found;
  // What a writer was just writing is whole at a second look.
  for (int look = 0; look < 2; ++look) {
    std::error_code absent;
    if (!std::filesystem::exists(log, absent)) return std::optional<LogDamage>();
    RAVENCAL_ASSIGN_OR_RETURN(const std::string bytes, core::read_whole_file(log));
    const std::optional<LogDamage> now = find_damage(bytes, page_size_of(path), columns);
    if (!now || (found && found->frame != now->frame)) return std::optional<LogDamage>();
    found = now;
  }
  return found;
}

}  // namespace ravencal::record
