// SPDX-License-Identifier: Apache-2.0
#include "exchange/isolated_read.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "core/isolated.hpp"
#include "exchange/byte_fields.hpp"
#include "exchange/exported.hpp"

namespace ravencal::exchange {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 26U;  // half of what in_child takes at once

template <typename T>
bool take_list(FieldReader& fields, std::vector<T>& items, bool (*read)(FieldReader&, T&)) {
  std::uint64_t count = 0;
  if (!fields.number(count)) return false;
  for (std::uint64_t i = 0; i < count; ++i) {
    T item;
    if (!read(fields, item)) return false;
    items.push_back(std::move(item));
  }
  return true;
}

void put(FieldWriter& fields, const NamedArray& array) {
  fields.text(array.name);
  fields.numbers(std::span(array.shape));
  fields.number(array.is_column_major);
  fields.numbers(std::span(array.values));
  fields.number(std::uint64_t{array.texts.size()});
  for (const std::string& text : array.texts) fields.text(text);
  fields.text(array.unreadable);
}

bool take(FieldReader& fields, NamedArray& array) {
  std::uint8_t is_column_major = 0;
  const bool ok = fields.text(array.name) && fields.numbers(array.shape) &&
                  fields.number(is_column_major) && fields.numbers(array.values) &&
                  take_list<std::string>(
                      fields, array.texts,
                      [](FieldReader& from, std::string& text) { return from.text(text); }) &&
                  fields.text(array.unreadable);
  array.is_column_major = is_column_major != 0;
  return ok;
}

void put(FieldWriter& fields, const record::Recording& recording) {
  fields.number(std::uint64_t{recording.meta.size()});
  for (const auto& [key, value] : recording.meta) fields.text(key), fields.text(value);
  fields.number(std::uint64_t{recording.channels.size()});
  for (const record::Channel& channel : recording.channels) {
    fields.text(channel.name);
    fields.text(channel.unit);
    fields.text(std::string(record::name_of(channel.role)));
    fields.text(channel.joint);
  }
  fields.numbers(std::span(recording.t_ns));
  fields.numbers(
      std::span(recording.samples.data(), static_cast<std::size_t>(recording.samples.size())));
  fields.number(std::uint64_t{recording.events.size()});
  for (const record::Event& event : recording.events) {
    fields.number(event.t_ns);
    fields.text(event.kind);
    fields.text(event.detail);
  }
}

bool take_channel(FieldReader& fields, record::Channel& channel) {
  std::string role;
  const bool ok = fields.text(channel.name) && fields.text(channel.unit) && fields.text(role) &&
                  fields.text(channel.joint);
  const auto known = record::role_from(role);
  channel.role = known.value_or(channel.role);
  return ok && known;
}

bool take_event(FieldReader& fields, record::Event& event) {
  return fields.number(event.t_ns) && fields.text(event.kind) && fields.text(event.detail);
}

bool take(FieldReader& fields, record::Recording& recording) {
  using Meta = std::pair<std::string, std::string>;
  std::vector<Meta> meta;
  std::vector<double> samples;
  const bool ok = take_list<Meta>(fields, meta,
                                  [](FieldReader& from, Meta& entry) {
                                    return from.text(entry.first) && from.text(entry.second);
                                  }) &&
                  take_list(fields, recording.channels, take_channel) &&
                  fields.numbers(recording.t_ns) && fields.numbers(samples) &&
                  take_list(fields, recording.events, take_event);
  const std::size_t rows = recording.t_ns.size();
  const std::size_t columns = recording.channels.size();
  if (!ok || samples.size() != rows * columns) return false;
  recording.meta.insert(meta.begin(), meta.end());
  recording.samples = Eigen::Map<const record::SampleMatrix>(
      samples.data(), static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  return true;
}

/// Sends items, and appends those that come to `items`. Each goes alone, in pieces, behind its
/// size.
template <typename Item>
core::Status through_child(const std::filesystem::path& path, const char* format,
                           const std::function<core::Result<std::vector<Item>>()>& read,
                           std::vector<Item>& items) {
  const auto work = [&](const core::TakePiece& send) -> core::Status {
    RAVENCAL_ASSIGN_OR_RETURN(const std::vector<Item> found, read());
    for (const Item& item : found) {
      FieldWriter head;
      FieldWriter fields;
      put(fields, item);
      head.number(std::uint64_t{fields.bytes().size()});
      RAVENCAL_RETURN_IF_ERROR(send(head.bytes()));
      std::span<const std::uint8_t> rest = fields.bytes();
      for (; !rest.empty(); rest = rest.subspan(std::min(rest.size(), kPieceBytes)))
        RAVENCAL_RETURN_IF_ERROR(send(rest.first(std::min(rest.size(), kPieceBytes))));
    }
    return {};
  };
  std::uint64_t missing = 0;
  std::vector<std::uint8_t> bytes;
  const auto receive = [&](std::span<const std::uint8_t> piece) -> core::Status {
    const auto wrong = [&] {
      return core::data_error(fmt::format("{}: its reader failed as {}", path.string(), format));
    };
    if (missing == 0) return FieldReader(piece).number(missing) ? core::Status() : wrong();
    if (piece.size() > missing) return wrong();
    bytes.insert(bytes.end(), piece.begin(), piece.end());
    missing -= piece.size();
    if (missing > 0) return {};
    FieldReader fields(bytes);
    const bool is_whole = take(fields, items.emplace_back());
    bytes.clear();
    return is_whole ? core::Status() : wrong();
  };
  core::Isolation bounds = core::Isolation::reading(path);
  bounds.memory_bytes *= 2;  // what is read, and what is sent of it
  const std::string doing = fmt::format("read as {}", format);
  return core::in_child(path, doing.c_str(), bounds, work, receive);
}

}  // namespace

core::Result<Arrays> in_child(const std::filesystem::path& path, const char* format,
                              core::Result<Arrays> (*read)(const std::filesystem::path&)) {
  RAVENCAL_RETURN_IF_ERROR(check_is_there(path));
  Arrays arrays;
  RAVENCAL_RETURN_IF_ERROR(through_child<NamedArray>(
      path, format, [&] { return read(path); }, arrays));
  return arrays;
}

core::Result<MaybeRecording> in_child(
    const std::filesystem::path& path, const char* format,
    core::Result<MaybeRecording> (*read)(const std::filesystem::path&)) {
  RAVENCAL_RETURN_IF_ERROR(check_is_there(path));
  std::vector<record::Recording> recordings;
  const auto as_list = [&]() -> core::Result<std::vector<record::Recording>> {
    RAVENCAL_ASSIGN_OR_RETURN(MaybeRecording recording, read(path));
    std::vector<record::Recording> list;
    if (recording) list.push_back(std::move(*recording));
    return list;
  };
  RAVENCAL_RETURN_IF_ERROR(through_child<record::Recording>(path, format, as_list, recordings));
  if (recordings.empty()) return MaybeRecording();
  RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording,
                            checked(std::move(recordings.front()), path));
  return MaybeRecording(std::move(recording));
}

}  // namespace ravencal::exchange
