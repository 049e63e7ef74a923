// SPDX-License-Identifier: Apache-2.0
#include "exchange/mat_read.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "exchange/exported.hpp"
#include "exchange/hdf5_handle.hpp"
#include "exchange/isolated_read.hpp"
#include "exchange/mat_check.hpp"

namespace ravencal::exchange {
namespace {

using MatFile = std::unique_ptr<mat_t, int (*)(mat_t*)>;
using MatVariable = std::unique_ptr<matvar_t, void (*)(matvar_t*)>;

constexpr int kDeepestStruct =
    16;  // no source: a choice; keeps a hostile file from the stack's end

core::Result<MatFile> open_mat(const std::filesystem::path& path) {
  hdf5_quiet();
  MatFile file(Mat_Open(path.c_str(), MAT_ACC_RDONLY), Mat_Close);
  if (!file || Mat_GetVersion(file.get()) == MAT_FT_MAT4) {
    return core::data_error(fmt::format(
        "{}: is not a whole MAT-file of level 5 or 7.3; was it cut short or renamed? MATLAB writes "
        "level 5 with save(..., '-v7')",
        path.string()));
  }
  if (Mat_GetVersion(file.get()) == MAT_FT_MAT73 && !stands_alone(hdf5_open(path.c_str())))
    return core::data_error(fmt::format("{}: {}", path.string(), kLiesElsewhere));
  if (Mat_GetVersion(file.get()) == MAT_FT_MAT5) RAVENCAL_RETURN_IF_ERROR(check_mat5(path));
  return file;
}

template <typename T>
void append_numbers(const matvar_t& variable, std::vector<double>& values) {
  const std::size_t count = variable.nbytes / sizeof(T);
  for (std::size_t i = 0; i < count; ++i) {
    T value;
    std::memcpy(&value, static_cast<const char*>(variable.data) + i * sizeof(T), sizeof(T));
    values.push_back(static_cast<double>(value));
  }
}

/// False: it is no matrix of numbers.
bool numbers_of(const matvar_t& variable, std::vector<double>& values) {
  using Append = void (*)(const matvar_t&, std::vector<double>&);
  struct Class {
    matio_classes kind;
    std::size_t bytes;
    Append append;
  };
  static constexpr Class kClasses[] = {
      {MAT_C_DOUBLE, 8, append_numbers<double>},
      {MAT_C_SINGLE, 4, append_numbers<float>},
      {MAT_C_INT64, 8, append_numbers<std::int64_t>},
      {MAT_C_UINT64, 8, append_numbers<std::uint64_t>},
      {MAT_C_INT32, 4, append_numbers<std::int32_t>},
      {MAT_C_UINT32, 4, append_numbers<std::uint32_t>},
      {MAT_C_INT16, 2, append_numbers<std::int16_t>},
      {MAT_C_UINT16, 2, append_numbers<std::uint16_t>},
      {MAT_C_INT8, 1, append_numbers<std::int8_t>},
      {MAT_C_UINT8, 1, append_numbers<std::uint8_t>},
  };
  for (const Class& known : kClasses) {
    if (known.kind != variable.class_type || variable.isComplex != 0) continue;
    if (variable.data == nullptr) return variable.nbytes == 0;
    if (static_cast<std::size_t>(variable.data_size) != known.bytes) return false;
    known.append(variable, values);
    return true;
  }
  return false;
}

/// A text of ASCII or UTF-8; of UTF-16 its ASCII characters, others as '?'.
std::optional<std::string> text_of(const matvar_t* variable) {
  if (variable == nullptr || variable->class_type != MAT_C_CHAR) return std::nullopt;
  if (variable->data == nullptr) return std::string();
  const auto* const bytes = static_cast<const unsigned char*>(variable->data);
  if (variable->data_size == 1) {
    // matio appends a zero to texts of more bytes than characters.
    const auto* const end = std::find(bytes, bytes + variable->nbytes, '\0');
    return std::string(bytes, end);
  }
  std::string text;
  for (std::size_t at = 0; at + 1 < variable->nbytes; at += 2) {
    std::uint16_t character = 0;
    std::memcpy(&character, bytes + at, sizeof(character));
    text += character < 0x80 ? static_cast<char>(character) : '?';
  }
  return text;
}

std::size_t count_of(const matvar_t& variable) {
  std::size_t count = 1;
  for (int i = 0; i < variable.rank; ++i) count *= variable.dims[i];
  return count;
}

std::optional<std::vector<std::string>> texts_of_cells(const matvar_t& variable) {
  std::vector<std::string> texts;
  const auto* const cells = static_cast<matvar_t* const*>(variable.data);
  for (std::size_t i = 0; cells != nullptr && i < count_of(variable); ++i) {
    auto text = text_of(cells[i]);
    if (!text) return std::nullopt;
    texts.push_back(std::move(*text));
  }
  return texts;
}

std::string why_unreadable(const matvar_t& variable) {
  switch (variable.class_type) {
    case MAT_C_CHAR:
      return fmt::format("it is the text '{}'", text_of(&variable).value_or("").substr(0, 40));
    case MAT_C_STRUCT:
      return "it is an array of structs, or structs within structs without end";
    case MAT_C_CELL:
      return "it is a cell array; save cell2mat of it";
    case MAT_C_SPARSE:
      return "it is sparse; save full of it";
    default:
      return variable.isComplex != 0 ? "its values are complex; save real and imag of it"
                                     : "it is an object of MATLAB (a table or timetable is one); "
                                       "save table2struct(T, 'ToScalar', true) of it";
  }
}

void flatten(const matvar_t& variable, const std::string& name, int depth,
             std::vector<NamedArray>& arrays) {
  const bool is_struct = variable.class_type == MAT_C_STRUCT && count_of(variable) == 1;
  if (is_struct && depth < kDeepestStruct) {
    // matio takes pointers to mutable variables, and changes none of these.
    auto* const parent = const_cast<matvar_t*>(&variable);
    char* const* const fields = Mat_VarGetStructFieldnames(parent);
    for (std::size_t i = 0; i < Mat_VarGetNumberOfFields(parent); ++i) {
      const matvar_t* const field = Mat_VarGetStructFieldByIndex(parent, i, 0);
      if (field != nullptr)
        flatten(*field, fmt::format("{}.{}", name, fields[i]), depth + 1, arrays);
    }
    return;
  }
  NamedArray array;
  array.name = name;
  array.is_column_major = true;
  array.shape.assign(variable.dims, variable.dims + variable.rank);
  const auto cells = variable.class_type == MAT_C_CELL ? texts_of_cells(variable) : std::nullopt;
  if (cells) {
    array.texts = *cells;
  } else if (!numbers_of(variable, array.values)) {
    array.unreadable = why_unreadable(variable);
  } else if (array.values.size() != count_of(variable)) {
    array.unreadable = "it is damaged";
  }
  if (!array.unreadable.empty()) array.values.clear();
  arrays.push_back(std::move(array));
}

/// What stands before a variable's values claims no more than the file can hold.
bool is_plausible(const matvar_t& info, std::uintmax_t file_bytes) {
  std::uintmax_t count = 1;
  for (int i = 0; i < info.rank; ++i) {
    if (info.dims[i] != 0 && count > file_bytes * kMostPerStoredByte / info.dims[i]) return false;
    count *= info.dims[i];
  }
  return true;
}

/// Takes an export apart; FORMATS.md has the layout.
class ExportedMat {
 public:
  ExportedMat(const std::filesystem::path& path, mat_t* file) : path_(path), file_(file) {}

  core::Result<record::Recording> read() {
    const MatVariable t_ns = variable("t_ns");
    if (!t_ns || t_ns->class_type != MAT_C_INT64) return damaged("t_ns is no int64");
    recording_.t_ns.resize(t_ns->nbytes / sizeof(std::int64_t));
    if (t_ns->data != nullptr) std::memcpy(recording_.t_ns.data(), t_ns->data, t_ns->nbytes);
    RAVENCAL_RETURN_IF_ERROR(read_channels());
    RAVENCAL_RETURN_IF_ERROR(read_samples());
    const MatVariable meta = variable("meta");
    for (std::size_t i = 0; meta && i < count_of(*meta); ++i)
      recording_.meta[text(meta, "key", i)] = text(meta, "value", i);
    const MatVariable events = variable("events");
    for (std::size_t i = 0; events && i < count_of(*events); ++i) {
      const matvar_t* const stamp = Mat_VarGetStructFieldByName(events.get(), "t_ns", i);
      if (stamp == nullptr || stamp->class_type != MAT_C_INT64 ||
          stamp->nbytes != sizeof(std::int64_t))
        return damaged(fmt::format("event {} has no t_ns", i));
      record::Event event{0, text(events, "kind", i), text(events, "detail", i)};
      std::memcpy(&event.t_ns, stamp->data, sizeof(event.t_ns));
      recording_.events.push_back(std::move(event));
    }
    return std::move(recording_);
  }

 private:
  [[nodiscard]] core::Error damaged(std::string_view why) const {
    return core::data_error(
        fmt::format("{}: is an export of ravencal, but {}", path_.string(), why));
  }
  [[nodiscard]] MatVariable variable(const char* name) const {
    return {Mat_VarRead(file_, name), Mat_VarFree};
  }
  static std::string text(const MatVariable& parent, const char* field, std::size_t index) {
    if (parent->class_type != MAT_C_STRUCT) return {};
    return text_of(Mat_VarGetStructFieldByName(parent.get(), field, index)).value_or("");
  }

  core::Status read_channels() {
    const MatVariable channels = variable("channels");
    if (!channels || channels->class_type != MAT_C_STRUCT) return damaged("channels is no struct");
    for (std::size_t i = 0; i < count_of(*channels); ++i) {
      auto channel = exported_channel(text(channels, "name", i), text(channels, "unit", i),
                                      text(channels, "role", i), text(channels, "joint", i));
      if (!channel.ok()) return damaged(channel.error().message);
      recording_.channels.push_back(std::move(*channel));
    }
    return {};
  }

  core::Status read_samples() {
    const MatVariable samples = variable("samples");
    const auto rows = static_cast<Eigen::Index>(recording_.t_ns.size());
    const auto columns = static_cast<Eigen::Index>(recording_.channels.size());
    if (!samples || samples->class_type != MAT_C_DOUBLE ||
        samples->nbytes != static_cast<std::size_t>(rows * columns) * sizeof(double)) {
      return damaged(fmt::format("samples is no matrix of {} x {}", rows, columns));
    }
    recording_.samples.resize(rows, columns);
    if (samples->data != nullptr)
      std::memcpy(recording_.samples.data(), samples->data, samples->nbytes);
    return {};
  }

  const std::filesystem::path& path_;
  mat_t* file_;
  record::Recording recording_;
};

core::Result<Arrays> read_mat_here(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const MatFile file, open_mat(path));
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(path, unknown);
  Arrays arrays;
  for (;;) {
    const MatVariable variable(Mat_VarReadNextInfo(file.get()), Mat_VarFree);
    if (!variable) break;
    const std::string name = variable->name == nullptr ? "" : variable->name;
    const bool is_read =
        is_plausible(*variable, bytes) && Mat_VarReadDataAll(file.get(), variable.get()) == 0;
    if (is_read) {
      flatten(*variable, name, 0, arrays);
    } else {
      arrays.push_back({.name = name, .unreadable = "it is damaged, or cut short"});
    }
  }
  if (arrays.empty()) return core::data_error(fmt::format("{}: holds no variable", path.string()));
  return arrays;
}

core::Result<MaybeRecording> read_mat_export_here(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const MatFile file, open_mat(path));
  for (const char* name : {"t_ns", "samples", "channels", "meta", "events"}) {
    const MatVariable info(Mat_VarReadInfo(file.get(), name), Mat_VarFree);
    if (!info) return MaybeRecording();
  }
  RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording, ExportedMat(path, file.get()).read());
  return std::optional(std::move(recording));
}

}  // namespace

core::Result<std::vector<NamedArray>> read_mat(const std::filesystem::path& path) {
  return in_child(path, "MAT", read_mat_here);
}

core::Result<std::optional<record::Recording>> read_exported_mat(
    const std::filesystem::path& path) {
  return in_child(path, "MAT", read_mat_export_here);
}

}  // namespace ravencal::exchange
