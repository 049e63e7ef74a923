// SPDX-License-Identifier: Apache-2.0
#include "record/csv_export.hpp"

#include <fcntl.h>
#include <fmt/compile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "core/output_place.hpp"
#include "core/units.hpp"
#include "core/whole_file.hpp"
#include "record/csv_number.hpp"
#include "record/profile_builtin.hpp"

namespace ravencal::record {
namespace {

/// One column of the file: file value = (SI value + shift) / to_si.
struct ExportColumn {
  enum class Source { kNothing, kTime, kChannel };
  Source source = Source::kNothing;
  std::string name;
  Eigen::Index channel = 0;
  double to_si = 1.0;
  double shift = 0.0;
};
using ExportColumns = std::vector<ExportColumn>;

core::Result<ExportColumn> channel_column(const Recording& recording, const Profile& profile,
                                          const ProfileChannel& wanted) {
  const auto channel = recording.column(wanted.channel.name);
  const auto unit = core::find_unit(wanted.channel.unit);
  if (!channel || !unit) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: no channel {}, which profile {} needs{}", recording.source,
                                   wanted.channel.name, profile.name,
                                   wanted.channel.role == Role::kJointTruth
                                       ? "; `ravencal merge` puts the truth of a recording of "
                                         "encoders beside the robot's states"
                                       : "")};
  }
  const std::string& si_unit = recording.channels[static_cast<std::size_t>(*channel)].unit;
  if (si_unit != unit->si_name) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: channel {} is in {}, but profile {} wants {}", recording.source,
                    wanted.channel.name, si_unit, profile.name, unit->name)};
  }
  ExportColumn column{ExportColumn::Source::kChannel, wanted.column, *channel,
                      unit->to_si * wanted.scale, -unit->to_si * wanted.offset};
  const auto origin = recording.meta.find("origin." + wanted.channel.name);
  if (wanted.relative && origin != recording.meta.end()) {
    column.shift += number_of(origin->second).value_or(0.0);
  }
  return column;
}

void place(ExportColumns& columns, std::optional<std::size_t> index, ExportColumn column) {
  if (!index) {
    const bool known = std::any_of(columns.begin(), columns.end(),
                                   [&](const ExportColumn& c) { return c.name == column.name; });
    if (!known) columns.push_back(std::move(column));
    return;
  }
  if (columns.size() <= *index) columns.resize(*index + 1);
  columns[*index] = std::move(column);
}

/// The columns for CRTK users, which repeat others: stamp and measured_js, without the void slot.
core::Status fill_raven2(const Recording& recording, ExportColumns& columns) {
  const auto jpos = [&](std::size_t slot) {
    return recording.column(
        core::catalogue()[core::catalogue_index(core::RavenField::kJpos, slot)].name);
  };
  columns[kRaven2StampColumn] = columns[kRaven2CatalogueColumn];
  std::size_t next = kRaven2MeasuredJsColumn;
  for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
    if (slot == static_cast<std::size_t>(core::JointSlot::kVoid)) continue;
    columns[next++] = {ExportColumn::Source::kChannel, "", *jpos(slot), 1.0, 0.0};
  }
  return {};
}

ExportColumn time_column(const std::string& name, const std::string& unit) {
  return {ExportColumn::Source::kTime, name, 0, core::find_unit(unit)->to_si, 0.0};
}

core::Result<ExportColumns> plan(const Recording& recording, const Profile& profile) {
  ExportColumns columns;
  if (profile.name == "generic") {
    columns.push_back(time_column("t_s", "s"));
    for (std::size_t c = 0; c < recording.channels.size(); ++c) {
      const Channel& channel = recording.channels[c];
      columns.push_back({ExportColumn::Source::kChannel, channel.name + "_" + channel.unit,
                         static_cast<Eigen::Index>(c), 1.0, 0.0});
    }
    return columns;
  }
  columns.resize(profile.column_count);
  if (profile.time_index || !profile.time_column.empty()) {
    place(columns, profile.time_index, time_column(profile.time_column, profile.clock.unit));
  }
  for (const ProfileChannel& wanted : profile.channels) {
    RAVENCAL_ASSIGN_OR_RETURN(ExportColumn column, channel_column(recording, profile, wanted));
    place(columns, wanted.index, std::move(column));
  }
  if (profile.name == "raven2") RAVENCAL_RETURN_IF_ERROR(fill_raven2(recording, columns));
  return columns;
}

/// Text of the number x with x * to_si == value_si: short where 15 digits suffice, else the nearest
/// double that converts back exactly, if rounding allows one.
void append_number(fmt::memory_buffer& out, double value_si, double to_si) {
  if (to_si == 1.0 || !std::isfinite(value_si)) {
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}"), value_si);
    return;
  }
  const double quotient = value_si / to_si;
  const std::size_t start = out.size();
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:.15g}"), quotient);
  double shortened = 0.0;
  (void)parse_number(out.data() + start, out.data() + out.size(), shortened);
  if (shortened * to_si == value_si) return;
  out.resize(start);
  double best = quotient;
  for (const double candidate :
       {std::nextafter(quotient, -HUGE_VAL), std::nextafter(quotient, HUGE_VAL)}) {
    if (best * to_si != value_si && candidate * to_si == value_si) best = candidate;
  }
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}"), best);
}

// Whole nanoseconds as decimal digits: a double of seconds would lose them after 104 days.
void append_time(fmt::memory_buffer& out, std::int64_t t_ns, double to_si) {
  if (to_si != 1.0) {
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}"),
                   static_cast<double>(t_ns) / std::round(1e9 * to_si));
    return;
  }
  constexpr std::int64_t kSecondNs = 1'000'000'000;
  const std::int64_t fraction = std::abs(t_ns % kSecondNs);
  fmt::format_to(std::back_inserter(out), "{}{}.{:09}", t_ns < 0 ? "-" : "",
                 std::abs(t_ns / kSecondNs), fraction);
}

void append_row(fmt::memory_buffer& out, const Recording& recording, const ExportColumns& columns,
                Eigen::Index row) {
  for (const ExportColumn& column : columns) {
    if (column.source == ExportColumn::Source::kTime) {
      append_time(out, recording.t_ns[static_cast<std::size_t>(row)], column.to_si);
    } else if (column.source == ExportColumn::Source::kChannel) {
      append_number(out, recording.samples(row, column.channel) + column.shift, column.to_si);
    }
    out.push_back(',');
  }
  out[out.size() - 1] = '\n';
}

struct CloseFile {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};

core::Status write_rows(const Recording& recording, const ExportColumns& columns, bool header,
                        const core::PartialFile& target) {
  const auto failed = [&] { return core::write_error(target.target(), errno); };
  const int own = ::fcntl(target.descriptor(), F_DUPFD_CLOEXEC, 0);
  const std::unique_ptr<std::FILE, CloseFile> file(own < 0 ? nullptr : ::fdopen(own, "w"));
  if (!file) return failed();
  fmt::memory_buffer text;
  if (header) {
    for (const ExportColumn& column : columns)
      fmt::format_to(std::back_inserter(text), "{},", column.name);
    text[text.size() - 1] = '\n';
  }
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    append_row(text, recording, columns, row);
    const bool last = row + 1 == recording.rows();
    if (text.size() < (1U << 20U) && !last) continue;
    if (std::fwrite(text.data(), 1, text.size(), file.get()) != text.size()) return failed();
    text.clear();
  }
  if (std::fflush(file.get()) != 0) return failed();
  return {};
}

}  // namespace

core::Status export_csv(const Recording& recording, const Profile& profile,
                        const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const ExportColumns columns, plan(recording, profile));
  RAVENCAL_ASSIGN_OR_RETURN(core::PartialFile target, core::PartialFile::create(path));
  RAVENCAL_RETURN_IF_ERROR(write_rows(recording, columns, profile.header, target));
  RAVENCAL_RETURN_IF_ERROR(target.publish());
  if (profile.name != "generic" || core::output_place(path).is_stream()) return {};
  return core::write_whole_file(profile_beside(path), profile_of(recording));
}

}  // namespace ravencal::record
