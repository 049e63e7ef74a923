// SPDX-License-Identifier: Apache-2.0
#include "exchange/mat_export.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/version.hpp"
#include "core/whole_file.hpp"
#include "record/channel.hpp"

namespace ravencal::exchange {
namespace {

constexpr std::size_t kMostBytes = (std::size_t{1} << 31U) - 4096;  // MAT-5: 32-bit sizes

using Variable = std::unique_ptr<matvar_t, void (*)(matvar_t*)>;

Variable variable(const char* name, matio_classes kind, matio_types type,
                  std::array<std::size_t, 2> shape, const void* values) {
  // matio takes a pointer to mutable data, and copies it here.
  return {Mat_VarCreate(name, kind, type, 2, shape.data(), const_cast<void*>(values), 0),
          Mat_VarFree};
}

Variable text(const std::string& value) {
  return variable(nullptr, MAT_C_CHAR, MAT_T_UTF8, {value.empty() ? 0U : 1U, value.size()},
                  value.data());
}

/// A struct array of `count` by 1 with these fields.
Variable struct_array(const char* name, std::size_t count, std::vector<const char*> fields) {
  std::size_t shape[2] = {count, 1};
  return {Mat_VarCreateStruct(name, 2, shape, fields.data(), static_cast<unsigned>(fields.size())),
          Mat_VarFree};
}

/// The struct owns the value from now on.
void set(const Variable& target, const char* field, std::size_t index, Variable value) {
  (void)Mat_VarSetStructFieldByName(target.get(), field, index, value.release());
}

Variable meta_of(const record::Recording& recording) {
  Variable meta = struct_array("meta", recording.meta.size(), {"key", "value"});
  std::size_t index = 0;
  for (const auto& [key, value] : recording.meta) {
    set(meta, "key", index, text(key));
    set(meta, "value", index++, text(value));
  }
  return meta;
}

Variable channels_of(const record::Recording& recording) {
  Variable channels =
      struct_array("channels", recording.channels.size(), {"name", "unit", "role", "joint"});
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    const record::Channel& channel = recording.channels[c];
    set(channels, "name", c, text(channel.name));
    set(channels, "unit", c, text(channel.unit));
    set(channels, "role", c, text(std::string(record::name_of(channel.role))));
    set(channels, "joint", c, text(channel.joint));
  }
  return channels;
}

Variable events_of(const record::Recording& recording) {
  Variable events = struct_array("events", recording.events.size(), {"t_ns", "kind", "detail"});
  for (std::size_t e = 0; e < recording.events.size(); ++e) {
    const record::Event& event = recording.events[e];
    set(events, "t_ns", e, variable(nullptr, MAT_C_INT64, MAT_T_INT64, {1, 1}, &event.t_ns));
    set(events, "kind", e, text(event.kind));
    set(events, "detail", e, text(event.detail));
  }
  return events;
}

bool write(const record::Recording& recording, mat_t* file) {
  const std::size_t rows = recording.t_ns.size();
  const std::array<Variable, 5> variables = {
      variable("t_ns", MAT_C_INT64, MAT_T_INT64, {rows, 1}, recording.t_ns.data()),
      variable("samples", MAT_C_DOUBLE, MAT_T_DOUBLE, {rows, recording.channels.size()},
               recording.samples.data()),
      channels_of(recording), meta_of(recording), events_of(recording)};
  bool ok = true;
  for (const Variable& value : variables) {
    ok = ok && value != nullptr && Mat_VarWrite(file, value.get(), MAT_COMPRESSION_NONE) == 0;
  }
  return ok;
}

/// matio does not notice that a disk is full, so what was written is read again.
bool reads_back(const record::Recording& recording, const std::filesystem::path& path) {
  const std::unique_ptr<mat_t, int (*)(mat_t*)> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY),
                                                     Mat_Close);
  if (!file) return false;
  const auto is_same = [&](const char* name, const void* values, std::size_t bytes) {
    const Variable read(Mat_VarRead(file.get(), name), Mat_VarFree);
    return read && read->nbytes == bytes &&
           (bytes == 0 || (read->data != nullptr && std::memcmp(read->data, values, bytes) == 0));
  };
  const auto exists = [&](const char* name) {
    return Variable(Mat_VarRead(file.get(), name), Mat_VarFree) != nullptr;
  };
  return is_same("t_ns", recording.t_ns.data(), recording.t_ns.size() * sizeof(std::int64_t)) &&
         is_same("samples", recording.samples.data(),
                 static_cast<std::size_t>(recording.samples.size()) * sizeof(double)) &&
         exists("channels") && exists("meta") && exists("events");
}

}  // namespace

core::Status export_mat(const record::Recording& recording, const std::filesystem::path& path) {
  if (static_cast<std::size_t>(recording.samples.size()) > kMostBytes / sizeof(double)) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: {} rows of {} channels are more than the 2 GiB that a MAT-file "
                    "of level 5 can hold; export to .h5, which MATLAB reads with h5read",
                    recording.source, recording.rows(), recording.channels.size())};
  }
  RAVENCAL_ASSIGN_OR_RETURN(core::PartialFile target, core::PartialFile::create(path));
  const std::string header =
      fmt::format("MATLAB 5.0 MAT-file, written by ravencal {}", core::kVersion);
  mat_t* const file = Mat_CreateVer(target.partial().c_str(), header.c_str(), MAT_FT_MAT5);
  const bool written = file != nullptr && write(recording, file);
  if (file == nullptr || Mat_Close(file) != 0 || !written ||
      !reads_back(recording, target.partial())) {
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be written; is the disk full, or the folder missing "
                                   "or read-only?",
                                   path.string())};
  }
  return target.publish();
}

}  // namespace ravencal::exchange
