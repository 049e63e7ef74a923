// SPDX-License-Identifier: Apache-2.0
#include "exchange/hdf5_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace ravencal::exchange {
namespace {

std::vector<std::size_t> shape_of(hid_t set) {
  const Hdf5Handle space(H5Dget_space(set), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  std::vector<hsize_t> sizes(static_cast<std::size_t>(std::max(rank, 0)));
  (void)H5Sget_simple_extent_dims(space.get(), sizes.data(), nullptr);
  return {sizes.begin(), sizes.end()};
}

/// Texts out of a dataset or attribute: `read` is H5Dread or H5Aread with everything but type and
/// buffer. Empty where they cannot be read.
template <typename Read>
std::vector<std::string> texts_of(hid_t type, hid_t space, std::size_t count, const Read& read) {
  std::vector<std::string> texts;
  if (H5Tis_variable_str(type) > 0) {
    const Hdf5Handle memory(H5Tcopy(H5T_C_S1), H5Tclose);
    (void)H5Tset_size(memory.get(), H5T_VARIABLE);
    (void)H5Tset_cset(memory.get(), H5Tget_cset(type));
    std::vector<char*> pointers(count, nullptr);
    if (read(memory.get(), pointers.data()) < 0) return texts;
    for (const char* text : pointers) texts.emplace_back(text == nullptr ? "" : text);
    (void)H5Dvlen_reclaim(memory.get(), space, H5P_DEFAULT, pointers.data());
    return texts;
  }
  const std::size_t width = H5Tget_size(type);
  std::vector<char> bytes(count * width);
  if (read(type, bytes.data()) < 0) return texts;
  for (std::size_t i = 0; i < count; ++i) {
    const char* const first = bytes.data() + i * width;
    texts.emplace_back(first, std::find(first, first + width, '\0'));
  }
  return texts;
}

herr_t note_dataset(hid_t, const char* name, const H5O_info_t* info, void* names) {
  if (info->type == H5O_TYPE_DATASET)
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
  return 0;
}

}  // namespace

core::Result<Hdf5File> Hdf5File::open(const std::filesystem::path& path) {
  hdf5_quiet();
  const std::uintmax_t bytes = std::filesystem::file_size(path);
  Hdf5Handle file = hdf5_open(path.c_str());
  if (!file.ok()) {
    return core::data_error(
        fmt::format("{}: is not a whole HDF5 file of {} bytes; was it cut short or renamed?",
                    path.string(), bytes));
  }
  if (!stands_alone(file))
    return core::data_error(fmt::format("{}: {}", path.string(), kLiesElsewhere));
  return Hdf5File(path, std::move(file), bytes);
}

std::optional<std::vector<std::string>> Hdf5File::datasets() const {
  std::vector<std::string> names;
  const herr_t status =
      H5Ovisit2(file_.get(), H5_INDEX_NAME, H5_ITER_INC, note_dataset, &names, H5O_INFO_BASIC);
  return status < 0 ? std::nullopt : std::optional(std::move(names));
}

bool Hdf5File::has(const std::string& name) const {
  return H5Lexists(file_.get(), name.c_str(), H5P_DEFAULT) > 0;
}

std::optional<std::size_t> Hdf5File::count_of(hid_t set,
                                              const std::vector<std::size_t>& shape) const {
  const Hdf5Handle type(H5Dget_type(set), H5Tclose);
  const std::uintmax_t stored = std::min<std::uintmax_t>(H5Dget_storage_size(set), bytes_);
  const std::uintmax_t most =
      stored * kMostPerStoredByte / std::max<std::size_t>(H5Tget_size(type.get()), 1);
  std::uintmax_t count = 1;
  for (const std::size_t size : shape) {
    if (size != 0 && count > most / size) return std::nullopt;
    count *= size;
  }
  return count > most ? std::nullopt : std::optional<std::size_t>(count);
}

NamedArray Hdf5File::array(const std::string& name) const {
  NamedArray array;
  array.name = name;
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.ok()) {
    array.unreadable = "it is damaged";
    return array;
  }
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.get());
  array.shape = shape_of(set.get());
  const auto count = count_of(set.get(), array.shape);
  if (!count) {
    array.unreadable = "it has fewer bytes than values: it was never written, or is damaged";
    return array;
  }
  const auto read = [&](hid_t memory, void* values) {
    return H5Dread(set.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
  };
  if (kind == H5T_STRING) {
    const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
    array.texts = texts_of(type.get(), space.get(), *count, read);
    if (array.texts.size() != *count) array.unreadable = "its texts are damaged";
  } else if (kind == H5T_INTEGER || kind == H5T_FLOAT || kind == H5T_ENUM) {
    array.values.resize(*count);
    if (*count > 0 && read(H5T_NATIVE_DOUBLE, array.values.data()) < 0)
      array.unreadable = "its values cannot be read: they are damaged or need another filter";
  } else {
    array.unreadable =
        "it holds neither numbers nor texts; write each field of a table as a "
        "dataset of its own";
  }
  if (!array.unreadable.empty()) array.values.clear(), array.texts.clear();
  return array;
}

std::optional<std::vector<std::int64_t>> Hdf5File::integers(const std::string& name) const {
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.ok()) return std::nullopt;
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const std::vector<std::size_t> shape = shape_of(set.get());
  const auto count = count_of(set.get(), shape);
  if (H5Tget_class(type.get()) != H5T_INTEGER || shape.size() != 1 || !count) return std::nullopt;
  std::vector<std::int64_t> values(*count);
  const bool is_read = *count == 0 || H5Dread(set.get(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL,
                                              H5P_DEFAULT, values.data()) >= 0;
  return is_read ? std::optional(std::move(values)) : std::nullopt;
}

std::vector<std::pair<std::string, std::string>> Hdf5File::attributes(
    const std::string& name) const {
  std::vector<std::pair<std::string, std::string>> found;
  const Hdf5Handle object(H5Oopen(file_.get(), name.c_str(), H5P_DEFAULT), H5Oclose);
  std::vector<std::string> names;
  const auto note = [](hid_t, const char* attribute, const H5A_info_t*, void* to) {
    static_cast<std::vector<std::string>*>(to)->emplace_back(attribute);
    return herr_t{0};
  };
  (void)H5Aiterate2(object.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, note, &names);
  for (const std::string& key : names) {
    const Hdf5Handle attribute(H5Aopen(object.get(), key.c_str(), H5P_DEFAULT), H5Aclose);
    const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
    const Hdf5Handle space(H5Aget_space(attribute.get()), H5Sclose);
    if (H5Tget_class(type.get()) != H5T_STRING || H5Sget_simple_extent_npoints(space.get()) != 1)
      continue;
    const std::vector<std::string> texts = texts_of(
        type.get(), space.get(), 1,
        [&](hid_t memory, void* values) { return H5Aread(attribute.get(), memory, values); });
    if (!texts.empty()) found.emplace_back(key, texts.front());
  }
  return found;
}

}  // namespace ravencal::exchange
