// SPDX-License-Identifier: Apache-2.0
#include "exchange/hdf5_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/version.hpp"
#include "core/whole_file.hpp"
#include "exchange/hdf5_handle.hpp"
#include "record/channel.hpp"

namespace ravencal::exchange {
namespace {

constexpr hsize_t kChunkRows = 16384;  // 128 KiB of doubles: well below HDF5's chunk cache of 1 MiB
constexpr unsigned kDeflateLevel = 1;  // with shuffling, most of the gain at a third of the time

/// Collects failures, so that a file is written line by line and judged once.
class Writer {
 public:
  explicit Writer(hid_t file) : file_(file), text_(H5Tcopy(H5T_C_S1), H5Tclose) {
    check(H5Tset_size(text_.get(), H5T_VARIABLE));
    check(H5Tset_cset(text_.get(), H5T_CSET_UTF8));
  }

  [[nodiscard]] bool ok() const { return ok_; }

  void group(const char* name) {
    Hdf5Handle group(H5Gcreate2(file_, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    ok_ = ok_ && group.ok() && group.close();
  }

  void attribute(hid_t object, const std::string& name, const std::string& value) {
    const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Hdf5Handle attribute(
        H5Acreate2(object, name.c_str(), text_.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose);
    const char* text = value.c_str();
    check(H5Awrite(attribute.get(), text_.get(), &text));
  }

  void texts(const char* name, const std::vector<std::string>& values) {
    std::vector<const char*> pointers;
    for (const std::string& value : values) pointers.push_back(value.c_str());
    (void)vector(name, text_.get(), text_.get(), pointers.data(), pointers.size());
  }

  /// A vector of `count` values; those of many are compressed.
  Hdf5Handle vector(const char* name, hid_t stored, hid_t given, const void* values,
                    std::size_t count) {
    const hsize_t size = count;
    const Hdf5Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
    const Hdf5Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    check(H5Pset_obj_track_times(properties.get(), false));  // one recording, one sequence of bytes
    if (count > kChunkRows && H5Tis_variable_str(stored) <= 0) {
      check(H5Pset_chunk(properties.get(), 1, &kChunkRows));
      check(H5Pset_shuffle(properties.get()));
      check(H5Pset_deflate(properties.get(), kDeflateLevel));
    }
    Hdf5Handle set(
        H5Dcreate2(file_, name, stored, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
        H5Dclose);
    ok_ = ok_ && set.ok();
    if (count > 0) check(H5Dwrite(set.get(), given, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
    return set;
  }

  hid_t file() const { return file_; }

 private:
  void check(herr_t status) { ok_ = ok_ && status >= 0; }

  hid_t file_;
  Hdf5Handle text_;
  bool ok_ = true;
};

void write_events(Writer& writer, const record::Recording& recording) {
  std::vector<std::int64_t> times;
  std::vector<std::string> kinds;
  std::vector<std::string> details;
  for (const record::Event& event : recording.events) {
    times.push_back(event.t_ns);
    kinds.push_back(event.kind);
    details.push_back(event.detail);
  }
  writer.group("events");
  (void)writer.vector("events/t_ns", H5T_STD_I64LE, H5T_NATIVE_INT64, times.data(), times.size());
  writer.texts("events/kind", kinds);
  writer.texts("events/detail", details);
}

bool write(const record::Recording& recording, hid_t file) {
  Writer writer(file);
  for (const auto& [key, value] : recording.meta) writer.attribute(file, key, value);
  writer.attribute(file, "exported_by", fmt::format("ravencal {}", core::kVersion));
  (void)writer.vector("t_ns", H5T_STD_I64LE, H5T_NATIVE_INT64, recording.t_ns.data(),
                      recording.t_ns.size());
  writer.group("channels");
  std::vector<std::string> names;
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    const record::Channel& channel = recording.channels[c];
    const auto column = recording.samples.col(static_cast<Eigen::Index>(c));
    const Hdf5Handle set =
        writer.vector(fmt::format("channels/{}", channel.name).c_str(), H5T_IEEE_F64LE,
                      H5T_NATIVE_DOUBLE, column.data(), recording.t_ns.size());
    writer.attribute(set.get(), "unit", channel.unit);
    writer.attribute(set.get(), "role", std::string(record::name_of(channel.role)));
    writer.attribute(set.get(), "joint", channel.joint);
    names.push_back(channel.name);
  }
  writer.texts("channel_order", names);
  write_events(writer, recording);
  return writer.ok();
}

}  // namespace

core::Status export_hdf5(const record::Recording& recording, const std::filesystem::path& path) {
  hdf5_quiet();
  for (const record::Channel& channel : recording.channels) {
    if (channel.name.find('/') == std::string::npos) continue;
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: channel '{}' has a slash in its name, which parts groups in "
                    "HDF5; export to .mat or .csv",
                    recording.source, channel.name)};
  }
  RAVENCAL_ASSIGN_OR_RETURN(core::PartialFile file, core::PartialFile::create(path));
  Hdf5Handle handle(H5Fcreate(file.partial().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT),
                    H5Fclose);
  const bool written = handle.ok() && write(recording, handle.get());
  if (!handle.close() || !written) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be written; is the disk full, or the folder missing "
                                   "or read-only?",
                                   path.string())};
  }
  return file.publish();
}

}  // namespace ravencal::exchange
