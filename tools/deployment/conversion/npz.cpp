// SPDX-License-Identifier: Apache-2.0
//
// The format of an array: numpy.lib.format, versions 1 to 3.
#include "conversion/npz.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>

namespace ravencal::conversion {
namespace {

constexpr std::uint64_t kMostBytes = 64U << 20U;  // far above any scaling

/// What numpy wrote before the values.
struct ArrayHeader {
  char kind = 0;  ///< 'f', 'i', 'u', 'b' or 'U'
  std::size_t bytes = 0;
  std::size_t count = 1;
  std::size_t values_at = 0;
};

/// The text between `key` and `end`.
std::optional<std::string> field(const std::string& text, const std::string& key, char end) {
  const std::size_t at = text.find(key);
  if (at == std::string::npos) return std::nullopt;
  const std::size_t from = at + key.size();
  const std::size_t to = text.find(end, from);
  if (to == std::string::npos) return std::nullopt;
  return text.substr(from, to - from);
}

std::optional<ArrayHeader> header_of(const std::string& bytes) {
  constexpr std::string_view kMagic = "\x93NUMPY";
  if (bytes.size() < 12 || !bytes.starts_with(kMagic)) return std::nullopt;
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  const bool is_first = byte(6) == 1;
  std::size_t size = byte(8) + (std::size_t{byte(9)} << 8U);
  if (!is_first) size += (std::size_t{byte(10)} << 16U) + (std::size_t{byte(11)} << 24U);
  ArrayHeader header;
  header.values_at = (is_first ? 10 : 12) + size;
  if (header.values_at > bytes.size()) return std::nullopt;
  const std::string text = bytes.substr(0, header.values_at);
  const auto type = field(text, "'descr': '", '\'');
  const auto shape = field(text, "'shape': (", ')');
  if (!type || !shape || type->size() < 3 || (type->front() != '<' && type->front() != '|')) {
    return std::nullopt;
  }
  header.kind = (*type)[1];
  header.bytes = std::strtoul(type->c_str() + 2, nullptr, 10) * (header.kind == 'U' ? 4 : 1);
  std::size_t longest = 1;
  for (std::size_t at = 0; at < shape->size();) {
    const std::size_t comma = std::min(shape->find(',', at), shape->size());
    const std::string size_text = shape->substr(at, comma - at);
    if (size_text.find_first_of("0123456789") != std::string::npos) {
      const std::size_t length = std::strtoul(size_text.c_str(), nullptr, 10);
      if (longest > 1 && length > 1) return std::nullopt;  // a matrix
      if (length == 0 || length > kMostBytes) return std::nullopt;
      longest = std::max(longest, length);
    }
    at = comma + 1;
  }
  header.count = longest;
  if (header.bytes == 0 || header.bytes > kMostBytes ||
      bytes.size() - header.values_at != header.count * header.bytes) {
    return std::nullopt;
  }
  return header;
}

template <typename T>
double number_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

std::optional<double> number(const ArrayHeader& header, const char* bytes) {
  if (header.kind == 'f' && header.bytes == 8) return number_at<double>(bytes);
  if (header.kind == 'f' && header.bytes == 4) return number_at<float>(bytes);
  if (header.kind == 'i' && header.bytes == 8) return number_at<std::int64_t>(bytes);
  if (header.kind == 'i' && header.bytes == 4) return number_at<std::int32_t>(bytes);
  if (header.kind == 'u' && header.bytes == 8) return number_at<std::uint64_t>(bytes);
  if (header.kind == 'u' && header.bytes == 4) return number_at<std::uint32_t>(bytes);
  return std::nullopt;
}

/// UTF-32 of ASCII characters, filled up with zeros.
std::optional<std::string> text(const ArrayHeader& header, const char* bytes) {
  std::string result;
  for (std::size_t at = 0; at < header.bytes; at += 4) {
    std::uint32_t character = 0;
    std::memcpy(&character, bytes + at, sizeof(character));
    if (character == 0) break;
    if (character > 0x7E) return std::nullopt;
    result += static_cast<char>(character);
  }
  return result;
}

core::Status add_array(const std::string& name, const std::string& bytes, NamedLists& lists) {
  const auto header = header_of(bytes);
  if (!header) {
    return core::data_error(fmt::format(
        "array '{}' is not a vector that numpy wrote on a little-endian machine", name));
  }
  for (std::size_t i = 0; i < header->count; ++i) {
    const char* at = bytes.data() + header->values_at + i * header->bytes;
    const auto value = number(*header, at);
    const auto word = header->kind == 'U' ? text(*header, at) : std::nullopt;
    if (value) {
      lists.numbers[name].push_back(*value);
    } else if (word) {
      lists.texts[name].push_back(*word);
    } else {
      return core::data_error(
          fmt::format("array '{}' holds neither float32, float64, whole numbers nor ASCII "
                      "texts; an object array becomes one by numpy.array(LIST, dtype=str)",
                      name));
    }
  }
  return {};
}

core::Result<std::string> bytes_of(zip_t* archive, zip_int64_t index) {
  zip_stat_t about;
  zip_stat_init(&about);
  const auto at = static_cast<zip_uint64_t>(index);
  if (zip_stat_index(archive, at, 0, &about) != 0 || about.size > kMostBytes) {
    return core::data_error(fmt::format("entry {} of the archive is damaged or too large", index));
  }
  std::string bytes(about.size, '\0');
  const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(zip_fopen_index(archive, at, 0),
                                                               zip_fclose);
  if (!file ||
      zip_fread(file.get(), bytes.data(), bytes.size()) != static_cast<zip_int64_t>(bytes.size())) {
    return core::data_error(fmt::format("entry {} of the archive cannot be read", index));
  }
  return bytes;
}

}  // namespace

core::Result<NamedLists> read_npz(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: no such file", path)};
  }
  int reason = 0;
  const std::unique_ptr<zip_t, void (*)(zip_t*)> archive(
      zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &reason), zip_discard);
  if (!archive) return core::data_error(fmt::format("{}: is not a whole .npz file", path));
  NamedLists lists;
  for (zip_int64_t i = 0; i < zip_get_num_entries(archive.get(), 0); ++i) {
    auto bytes = bytes_of(archive.get(), i);
    if (!bytes.ok()) return core::data_error(fmt::format("{}: {}", path, bytes.error().message));
    std::string name = zip_get_name(archive.get(), static_cast<zip_uint64_t>(i), 0);
    if (name.ends_with(".npy")) name.resize(name.size() - 4);
    const core::Status added = add_array(name, *bytes, lists);
    if (!added.ok()) return core::data_error(fmt::format("{}: {}", path, added.error().message));
  }
  return lists;
}

}  // namespace ravencal::conversion
