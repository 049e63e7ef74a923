// SPDX-License-Identifier: Apache-2.0
#include "record/profile_toml.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/known_words.hpp"
#include "core/toml_table.hpp"
#include "core/units.hpp"
#include "core/whole_file.hpp"
#include "record/profile_builtin.hpp"

namespace ravencal::record {
namespace {

using core::TomlTable;

constexpr core::IntegerRange kFromZero{0, std::numeric_limits<std::int64_t>::max()};

std::optional<std::size_t> take_index(TomlTable& table, std::string_view key) {
  const auto index = table.find_integer(key, kFromZero);
  return index ? std::optional(static_cast<std::size_t>(*index)) : std::nullopt;
}

// Every place that names a column does so by header name or by index, never by both.
void take_column(TomlTable& table, std::string& column, std::optional<std::size_t>& index) {
  column = table.text_or("column", "");
  index = take_index(table, "index");
  if (column.empty() == !index.has_value()) {
    table.fail("give either column = \"header name\" or index = number");
  }
}

core::Result<ProfileFilter> read_filter(TomlTable& table, std::string_view values_key) {
  ProfileFilter filter;
  take_column(table, filter.column, filter.index);
  filter.keep = table.words(values_key);
  RAVENCAL_RETURN_IF_ERROR(table.finish());
  return filter;
}

/// negate = true is another word for scale = -1.
void take_scale(TomlTable& table, ProfileChannel& channel) {
  if (table.has("negate") && table.has("scale")) {
    table.fail("negate", "a channel has either negate or scale; a negative scale turns the sign");
  }
  channel.scale = table.boolean_or("negate", false) ? -1.0 : table.number_or("scale", 1.0);
  if (channel.scale == 0.0) table.fail("scale", "scale must not be 0: every value would be lost");
  channel.offset = table.number_or("offset", 0.0);
}

core::Result<ProfileChannel> read_channel(TomlTable& table) {
  ProfileChannel channel;
  channel.channel.name = table.text_or("name", "");
  channel.channel.unit = table.text_or("unit", channel.channel.unit);
  const std::string role = table.text_or("role", "feature");
  channel.channel.joint = table.text_or("joint", "");
  take_scale(table, channel);
  channel.wraps_at = table.number_or("wraps_at", channel.wraps_at);
  if (!(channel.wraps_at >= 0.0) || std::isinf(channel.wraps_at))
    table.fail("wraps_at",
               "wraps_at is how far the file's values count until they start again, above 0; 0: "
               "they do not");
  channel.may_be_missing = table.boolean_or("may_be_missing", channel.may_be_missing);
  channel.relative = table.boolean_or("relative", channel.relative);
  channel.assumed = table.boolean_or("assumed", channel.assumed);
  channel.plausible = table.boolean_or("plausible", channel.plausible);
  take_column(table, channel.column, channel.index);
  if (channel.channel.name.empty()) table.fail("a channel needs a name");
  if (!core::find_unit(channel.channel.unit)) {
    table.fail("unit", fmt::format("channel {}: unknown unit '{}'{}", channel.channel.name,
                                   channel.channel.unit,
                                   core::instead_of(channel.channel.unit, core::unit_names())));
  }
  if (const auto known = role_from(role)) {
    channel.channel.role = *known;
  } else {
    table.fail("role", fmt::format("channel {}: unknown role '{}'{}", channel.channel.name, role,
                                   core::instead_of(role, role_names())));
  }
  if (auto condition = table.table("valid_when")) {
    RAVENCAL_ASSIGN_OR_RETURN(channel.valid_when, read_filter(*condition, "equals"));
  }
  RAVENCAL_RETURN_IF_ERROR(table.finish());
  return channel;
}

void take_clock(TomlTable& table, Profile& profile) {
  const auto is_time = [](std::string_view name) {
    const auto unit = core::find_unit(name);
    return unit && unit->si_name == "s";
  };
  Clock& clock = profile.clock;
  clock.unit = table.text_or("time_unit", clock.unit);
  if (!is_time(clock.unit) && !is_written_out(clock.unit)) {
    table.fail("time_unit",
               fmt::format("time_unit '{}' is not s, ms, us, ns, date or clock", clock.unit));
  }
  if (table.holds_text("time_fraction"))
    profile.fraction_column = table.text("time_fraction");
  else
    profile.fraction_index = take_index(table, "time_fraction");
  clock.fraction_unit = table.text_or("time_fraction_unit", clock.fraction_unit);
  if (!is_time(clock.fraction_unit)) {
    table.fail("time_fraction_unit",
               fmt::format("time_fraction_unit '{}' is not ms, us or ns", clock.fraction_unit));
  }
  clock.wraps_at = table.number_or("time_wraps_at", clock.wraps_at);
  clock.rounded_to = table.number_or("time_rounded_to", clock.rounded_to);
  if (!(clock.wraps_at >= 0.0) || !(clock.rounded_to >= 0.0))
    table.fail("time_wraps_at and time_rounded_to must be 0 or more");
  const std::string bad = table.text_or("bad_stamps", "error");
  clock.drops_bad = bad == "drop";
  if (bad != "error" && bad != "drop")
    table.fail("bad_stamps", "bad_stamps must be \"error\" or \"drop\"");
}

void take_time(TomlTable& table, Profile& profile) {
  if (table.holds_text("time")) {
    profile.time_column = table.text("time");
  } else if (table.has("time") && !table.holds_integer("time")) {
    table.fail("time", "time must be a header name or a column number from 0");
  } else {
    profile.time_index = take_index(table, "time");
  }
  take_clock(table, profile);
  const bool assumed = table.boolean_or("assumed", false);
  profile.row_period_stated = table.has("row_period_s") && !assumed;
  if (assumed && (!profile.time_column.empty() || profile.time_index))
    profile.meta["assumed_time_unit"] = profile.clock.unit;
  profile.row_period_s = table.number_or("row_period_s", profile.row_period_s);
  if (!(profile.row_period_s > 0.0)) table.fail("row_period_s must be above 0");
  profile.truth_from_s = table.number_or("truth_from_s", profile.truth_from_s);
  if (!(profile.truth_from_s >= 0.0)) table.fail("truth_from_s must be 0 or more");
  profile.time_restarts = table.boolean_or("time_restarts", profile.time_restarts);
  if (profile.time_restarts && profile.clock.drops_bad) {
    table.fail("bad_stamps",
               "bad_stamps = \"drop\" and time_restarts = true read a time that runs backwards in "
               "two ways; "
               "state one of them");
  }
  const std::string missing = table.text_or("time_missing", "error");
  profile.row_number_if_time_missing = missing == "row_number";
  if (missing != "error" && missing != "row_number") {
    table.fail("time_missing must be \"error\" or \"row_number\"");
  }
}

core::Status read_source(TomlTable& table, Profile& profile) {
  profile.format = table.text_or("format", profile.format);
  if (profile.format != "csv" && profile.format != "bag") {
    table.fail(fmt::format("format '{}'; known: csv, bag", profile.format));
  }
  profile.header = table.boolean_or("header", profile.header);
  profile.homed = table.boolean_or("homed", profile.homed);
  if (profile.homed && profile.format == "bag")
    table.fail("homed is for tables; for bags, `train --session recording` says the same");
  take_time(table, profile);
  profile.column_count = take_index(table, "columns").value_or(0);
  if (profile.format == "bag") {
    profile.state_topic = table.text_or("state_topic", "");
    profile.truth_topic = table.text_or("truth_topic", "");
  }
  profile.robot = table.text_or("robot", profile.robot);
  profile.arm = table.text_or("arm", profile.arm);
  profile.episode.column = table.text_or("episode", "");
  const std::string reference = table.text_or("reference", "");
  profile.reference_first = reference == "first";
  if (!reference.empty() && reference != "first") table.fail("reference can only be \"first\"");
  if (!profile.header && !(profile.time_column.empty() && profile.fraction_column.empty() &&
                           profile.episode.column.empty())) {
    table.fail("a source without header has no named columns; give column numbers");
  }
  return table.finish();
}

/// A bag's channels are those of its messages; a file can only say which topics and which arm.
core::Result<Profile> bag_profile(const Profile& read, TomlTable& source, bool has_columns) {
  auto built_in = raven2_bag_profile(read.arm.empty() ? "gold" : read.arm);
  if (has_columns) {
    source.fail("format",
                "a bag's channels are those of raven_state and ext_jpos; [[channel]] and "
                "[[filter]] are for .csv");
  } else if (!built_in.ok()) {
    source.fail("arm", built_in.error().message);
  }
  RAVENCAL_RETURN_IF_ERROR(source.finish());
  Profile profile = std::move(*built_in);
  profile.name = read.name;
  profile.state_topic = read.state_topic;
  profile.truth_topic = read.truth_topic;
  if (!read.robot.empty()) profile.robot = read.robot;
  return profile;
}

core::Status read_meta(TomlTable& table, Profile& profile) {
  for (const std::string& key : table.unread_keys()) profile.meta[key] = table.text(key);
  return table.finish();
}

core::Status read_event(TomlTable& table, Profile& profile) {
  Event event;
  if (const auto t_ns = table.find_integer("t_ns")) {
    event.t_ns = *t_ns;
  } else {
    table.fail_missing("t_ns");
  }
  event.kind = table.text("kind");
  event.detail = table.text_or("detail", "");
  profile.events.push_back(std::move(event));
  return table.finish();
}

core::Result<Profile> read_profile(TomlTable& root, std::string name) {
  Profile profile;
  profile.name = std::move(name);
  auto source = root.table("source");
  if (!source) root.fail("a profile needs a [source] table");
  const bool bag = source && source->text_or("format", "csv") == "bag";
  if (!bag && !root.has("channel")) root.fail("a profile needs [[channel]] tables");
  std::vector<TomlTable> channels = root.tables("channel");
  std::vector<TomlTable> filters = root.tables("filter");
  std::vector<TomlTable> events = root.tables("event");
  auto meta = root.table("meta");
  RAVENCAL_RETURN_IF_ERROR(root.finish());
  RAVENCAL_RETURN_IF_ERROR(read_source(*source, profile));
  if (bag) return bag_profile(profile, *source, !channels.empty() || !filters.empty());
  for (TomlTable& table : channels) {
    RAVENCAL_ASSIGN_OR_RETURN(profile.channels.emplace_back(), read_channel(table));
  }
  for (TomlTable& table : filters) {
    RAVENCAL_ASSIGN_OR_RETURN(profile.filters.emplace_back(), read_filter(table, "keep"));
  }
  if (meta) RAVENCAL_RETURN_IF_ERROR(read_meta(*meta, profile));
  for (TomlTable& table : events) RAVENCAL_RETURN_IF_ERROR(read_event(table, profile));
  return profile;
}

}  // namespace

core::Result<Profile> parse_profile(std::string_view text, const std::string& source) {
  RAVENCAL_ASSIGN_OR_RETURN(TomlTable root, core::parse_toml(text, source, "a profile"));
  return read_profile(root, std::filesystem::path(source).stem().string());
}

core::Result<Profile> read_profile_file(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  return parse_profile(text, path.string());
}

}  // namespace ravencal::record
