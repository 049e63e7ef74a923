// SPDX-License-Identifier: Apache-2.0
//
// The format of an array: numpy.lib.format, versions 1 to 3.
#include "exchange/npz.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>

#include "core/whole_file.hpp"

namespace ravencal::exchange {
namespace {

/// What numpy wrote before the values.
struct ArrayHeader {
  std::string type;  ///< '<f8'
  std::vector<std::size_t> shape;
  bool is_column_major = false;
  std::size_t values_at = 0;

  [[nodiscard]] char kind() const { return type[1]; }
  [[nodiscard]] std::size_t bytes() const {
    return std::strtoul(type.c_str() + 2, nullptr, 10) * (kind() == 'U' ? 4 : 1);
  }
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

/// "3, 4" or "3,".
std::vector<std::size_t> sizes_in(const std::string& text) {
  std::vector<std::size_t> sizes;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::string size = text.substr(at, comma - at);
    if (size.find_first_of("0123456789") != std::string::npos)
      sizes.push_back(std::strtoul(size.c_str(), nullptr, 10));
    at = comma + 1;
  }
  return sizes;
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
  const auto shape = field(text, "'shape': (", ')');
  if (!shape) return std::nullopt;
  header.type = field(text, "'descr': '", '\'').value_or("");
  header.shape = sizes_in(*shape);
  header.is_column_major = text.find("'fortran_order': True") != std::string::npos;
  return header;
}

using ToNumber = double (*)(const char*);

template <typename T>
double number_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

ToNumber number_of_type(std::string_view type) {
  struct Type {
    std::string_view name;
    ToNumber number;
  };
  static constexpr Type kTypes[] = {
      {"f2", number_at<Eigen::half>},   {"f4", number_at<float>},
      {"f8", number_at<double>},        {"i1", number_at<std::int8_t>},
      {"i2", number_at<std::int16_t>},  {"i4", number_at<std::int32_t>},
      {"i8", number_at<std::int64_t>},  {"u1", number_at<std::uint8_t>},
      {"u2", number_at<std::uint16_t>}, {"u4", number_at<std::uint32_t>},
      {"u8", number_at<std::uint64_t>}, {"b1", number_at<std::uint8_t>},
  };
  for (const Type& known : kTypes) {
    if (known.name == type) return known.number;
  }
  return nullptr;
}

/// ASCII characters of `width` bytes, filled up with zeros.
std::optional<std::string> text_at(const char* bytes, std::size_t size, std::size_t width) {
  std::string result;
  for (std::size_t at = 0; at + width <= size; at += width) {
    std::uint32_t character = 0;
    std::memcpy(&character, bytes + at, width);
    if (character == 0) break;
    if (character > 0x7E) return std::nullopt;
    result += static_cast<char>(character);
  }
  return result;
}

/// Number of values, or nothing if the bytes do not hold as many.
std::optional<std::size_t> count_of(const ArrayHeader& header, std::size_t bytes) {
  std::size_t count = 1;
  for (const std::size_t size : header.shape) {
    if (size != 0 && count > bytes / size) return std::nullopt;
    count *= size;
  }
  const std::size_t each = header.bytes();
  const bool is_whole = each != 0 && bytes % each == 0 && bytes / each == count;
  return is_whole ? std::optional(count) : std::nullopt;
}

core::Result<NamedArray> array_of(const std::string& name, const std::string& bytes) {
  const auto header = header_of(bytes);
  if (!header) {
    return core::data_error(fmt::format("array '{}' does not begin as numpy writes it", name));
  }
  NamedArray array;
  array.name = name;
  array.shape = header->shape;
  array.is_column_major = header->is_column_major;
  if (header->type.size() < 3) {
    array.unreadable = "it is a structured array; save each field as an array of its own";
    return array;
  }
  const ToNumber number = number_of_type(std::string_view(header->type).substr(1));
  const std::size_t width = header->kind() == 'U' ? 4 : header->kind() == 'S' ? 1 : 0;
  const bool is_here = header->type[0] == '<' || header->type[0] == '|';
  if (!is_here || (number == nullptr && width == 0)) {
    array.unreadable = fmt::format(
        "its type is {}; float64, whole numbers, booleans and ASCII texts of a little-endian "
        "machine can be read, so save it as ARRAY.astype('f8') or numpy.array(LIST, dtype=str)",
        header->type);
    return array;
  }
  const auto count = count_of(*header, bytes.size() - header->values_at);
  if (!count) {
    return core::data_error(fmt::format(
        "array '{}' is cut short: {} bytes of values, which are not {} of {}", name,
        bytes.size() - header->values_at, fmt::join(header->shape, " x "), header->type));
  }
  for (std::size_t i = 0; i < *count; ++i) {
    const char* const at = bytes.data() + header->values_at + i * header->bytes();
    if (number != nullptr) {
      array.values.push_back(number(at));
    } else if (auto text = text_at(at, header->bytes(), width)) {
      array.texts.push_back(std::move(*text));
    } else {
      array.unreadable = fmt::format("text {} is not ASCII", i);
      array.texts.clear();
      break;
    }
  }
  return array;
}

core::Result<std::string> bytes_of(zip_t* archive, zip_int64_t index) {
  zip_stat_t about;
  zip_stat_init(&about);
  const auto at = static_cast<zip_uint64_t>(index);
  const bool is_known = zip_stat_index(archive, at, 0, &about) == 0;
  const bool is_numpys =
      is_known && (about.comp_method == ZIP_CM_STORE || about.comp_method == ZIP_CM_DEFLATE);
  if (!is_numpys || about.size / kMostPerStoredByte > about.comp_size) {
    return core::data_error(fmt::format("entry {} of the archive is damaged", index));
  }
  std::string bytes(about.size, '\0');
  const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(zip_fopen_index(archive, at, 0),
                                                               zip_fclose);
  char behind = 0;  // libzip compares checksums where a read meets the end
  if (!file ||
      zip_fread(file.get(), bytes.data(), bytes.size()) != static_cast<zip_int64_t>(bytes.size()) ||
      zip_fread(file.get(), &behind, 1) != 0) {
    return core::data_error(fmt::format("entry {} of the archive cannot be read", index));
  }
  return bytes;
}

core::Error with_file(const std::filesystem::path& path, const core::Error& error) {
  return {error.code, fmt::format("{}: {}", path.string(), error.message)};
}

}  // namespace

core::Result<std::vector<NamedArray>> read_npz(const std::filesystem::path& path) {
  RAVENCAL_RETURN_IF_ERROR(check_is_there(path));
  int reason = 0;
  const std::unique_ptr<zip_t, void (*)(zip_t*)> archive(
      zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &reason), zip_discard);
  if (!archive) {
    return core::data_error(
        fmt::format("{}: is not a whole .npz file, as numpy.savez writes it; was it cut short?",
                    path.string()));
  }
  std::vector<NamedArray> arrays;
  for (zip_int64_t i = 0; i < zip_get_num_entries(archive.get(), 0); ++i) {
    const auto bytes = bytes_of(archive.get(), i);
    if (!bytes.ok()) return with_file(path, bytes.error());
    std::string name = zip_get_name(archive.get(), static_cast<zip_uint64_t>(i), 0);
    if (name.ends_with(".npy")) name.resize(name.size() - 4);
    auto array = array_of(name, *bytes);
    if (!array.ok()) return with_file(path, array.error());
    arrays.push_back(std::move(*array));
  }
  return arrays;
}

core::Result<NamedArray> read_npy(const std::filesystem::path& path) {
  RAVENCAL_RETURN_IF_ERROR(check_is_there(path));
  RAVENCAL_ASSIGN_OR_RETURN(const std::string bytes, core::read_whole_file(path));
  auto array = array_of("", bytes);
  if (!array.ok()) return with_file(path, array.error());
  return array;
}

}  // namespace ravencal::exchange
