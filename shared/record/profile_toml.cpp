// SPDX-License-Identifier: Apache-2.0
#include "record/profile_toml.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cmath>
#include <set>

#include "core/units.hpp"

namespace ravencal::record {
namespace fs = std::filesystem;
namespace {

/// Reads one TOML table key by key and remembers the first thing that is wrong with it.
class TableReader {
 public:
  TableReader(const toml::table& table, const fs::path& path) : table_(table), path_(path) {}

  /// The node of that key, if present; marks the key as known.
  const toml::node* take(std::string_view key) {
    known_.insert(std::string(key));
    return table_.get(key);
  }
  void take(std::string_view key, std::string& out) { take_as<std::string>(key, "a text", out); }
  void take(std::string_view key, bool& out) { take_as<bool>(key, "true or false", out); }
  void take(std::string_view key, double& out) { take_as<double>(key, "a number", out); }

  std::optional<std::size_t> take_index(std::string_view key) {
    const toml::node* node = take(key);
    if (node == nullptr) return std::nullopt;
    const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
    if (value && *value >= 0) return static_cast<std::size_t>(*value);
    fail(*node, fmt::format("{} must be a whole number from 0", key));
    return std::nullopt;
  }

  void fail(const toml::node& node, std::string why) {
    if (!error_) error_ = core::Error{core::ErrorCode::kData, where(node) + std::move(why)};
  }
  void fail(std::string why) { fail(table_, std::move(why)); }

  /// The first failure, or the first key that nobody asked for.
  core::Status finish(std::string_view table_name) {
    for (const auto& [key, node] : table_) {
      const std::string word(key.str());
      if (known_.contains(word)) continue;
      fail(node, fmt::format("unknown key '{}' in {}; known: {}", word, table_name,
                             fmt::join(known_, ", ")));
    }
    return error_ ? core::Status(*error_) : core::Status();
  }

 private:
  template <typename T>
  void take_as(std::string_view key, std::string_view kind, T& out) {
    const toml::node* node = take(key);
    if (node == nullptr) return;
    // toml++ would turn 1 into true; whole numbers are fine where a number is wanted.
    const bool fits = std::is_same_v<T, double> ? node->is_number() : node->is<T>();
    if (fits) {
      out = *node->value<T>();
    } else {
      fail(*node, fmt::format("{} must be {}", key, kind));
    }
  }
  [[nodiscard]] std::string where(const toml::node& node) const {
    return fmt::format("{}:{}: ", path_.string(), node.source().begin.line);
  }

  const toml::table& table_;
  const fs::path& path_;
  std::set<std::string> known_;
  std::optional<core::Error> error_;
};

std::optional<std::string> word_of(const toml::node& node) {
  if (node.is_number()) return fmt::format("{}", *node.value<double>());
  return node.value<std::string>();
}

void take_words(TableReader& reader, std::string_view key, std::vector<std::string>& words) {
  const toml::node* node = reader.take(key);
  if (node == nullptr) return;
  const auto add = [&](const toml::node& item) {
    if (auto word = word_of(item)) {
      words.push_back(std::move(*word));
    } else {
      reader.fail(item, fmt::format("{} must hold numbers or texts", key));
    }
  };
  if (const toml::array* list = node->as_array()) {
    for (const toml::node& item : *list) add(item);
  } else {
    add(*node);
  }
}

// Every place that names a column does so by header name or by index, never by both.
void take_column(TableReader& reader, std::string& column, std::optional<std::size_t>& index) {
  reader.take("column", column);
  index = reader.take_index("index");
  if (column.empty() == !index.has_value()) {
    reader.fail("give either column = \"header name\" or index = number");
  }
}

core::Result<ProfileFilter> read_filter(const toml::table& table, const fs::path& path,
                                        std::string_view values_key, std::string_view name) {
  TableReader reader(table, path);
  ProfileFilter filter;
  take_column(reader, filter.column, filter.index);
  take_words(reader, values_key, filter.keep);
  if (filter.keep.empty()) reader.fail(fmt::format("{} is missing", values_key));
  RAVENCAL_RETURN_IF_ERROR(reader.finish(name));
  return filter;
}

core::Result<ProfileChannel> read_channel(const toml::table& table, const fs::path& path) {
  TableReader reader(table, path);
  ProfileChannel channel;
  std::string role = "feature";
  reader.take("name", channel.channel.name);
  reader.take("unit", channel.channel.unit);
  reader.take("role", role);
  reader.take("joint", channel.channel.joint);
  reader.take("may_be_missing", channel.may_be_missing);
  reader.take("relative", channel.relative);
  take_column(reader, channel.column, channel.index);
  if (channel.channel.name.empty()) reader.fail("a channel needs a name");
  if (!core::find_unit(channel.channel.unit)) {
    reader.fail(
        fmt::format("channel {}: unknown unit '{}'", channel.channel.name, channel.channel.unit));
  }
  if (const auto known = role_from(role)) {
    channel.channel.role = *known;
  } else {
    reader.fail(fmt::format("channel {}: unknown role '{}'", channel.channel.name, role));
  }
  if (const toml::node* node = reader.take("valid_when")) {
    if (const toml::table* condition = node->as_table()) {
      RAVENCAL_ASSIGN_OR_RETURN(channel.valid_when,
                                read_filter(*condition, path, "equals", "valid_when"));
    } else {
      reader.fail(*node, "valid_when must be {column = .., equals = ..}");
    }
  }
  RAVENCAL_RETURN_IF_ERROR(reader.finish("[[channel]]"));
  return channel;
}

void take_time(TableReader& reader, Profile& profile) {
  if (const toml::node* time = reader.take("time")) {
    const auto index = time->is_integer() ? time->value<std::int64_t>() : std::nullopt;
    if (index && *index >= 0) {
      profile.time_index = static_cast<std::size_t>(*index);
    } else if (time->is_string()) {
      profile.time_column = *time->value<std::string>();
    } else {
      reader.fail(*time, "time must be a header name or a column number from 0");
    }
  }
  reader.take("time_unit", profile.time_unit);
  const auto unit = core::find_unit(profile.time_unit);
  if (!unit || unit->si_name != "s") {
    reader.fail(fmt::format("time_unit '{}' is not s, ms, us or ns", profile.time_unit));
  }
  reader.take("row_period_s", profile.row_period_s);
  if (!(profile.row_period_s > 0.0) || !std::isfinite(profile.row_period_s)) {
    reader.fail("row_period_s must be above 0");
  }
  reader.take("time_restarts", profile.time_restarts);
  std::string missing = "error";
  reader.take("time_missing", missing);
  profile.row_number_if_time_missing = missing == "row_number";
  if (missing != "error" && missing != "row_number") {
    reader.fail("time_missing must be \"error\" or \"row_number\"");
  }
}

core::Status read_source(const toml::table& table, const fs::path& path, Profile& profile) {
  TableReader reader(table, path);
  reader.take("format", profile.format);
  if (profile.format != "csv" && profile.format != "bag") {
    reader.fail(fmt::format("format '{}'; known: csv, bag", profile.format));
  }
  reader.take("header", profile.header);
  take_time(reader, profile);
  profile.column_count = reader.take_index("columns").value_or(0);
  reader.take("robot", profile.robot);
  reader.take("arm", profile.arm);
  reader.take("episode", profile.episode.column);
  std::string reference;
  reader.take("reference", reference);
  profile.reference_first = reference == "first";
  if (!reference.empty() && reference != "first") reader.fail("reference can only be \"first\"");
  if (!profile.header && !(profile.time_column.empty() && profile.episode.column.empty())) {
    reader.fail("a source without header has no named columns; give column numbers");
  }
  return reader.finish("[source]");
}

template <typename OnTable>
core::Status for_each_table(const toml::node* node, std::string_view name, const fs::path& path,
                            OnTable&& on_table) {
  if (node == nullptr) return {};
  const toml::array* list = node->as_array();
  if (list == nullptr || !list->is_homogeneous<toml::table>()) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}:{}: write [[{}]] tables", path.string(), node->source().begin.line, name)};
  }
  for (const toml::node& item : *list) RAVENCAL_RETURN_IF_ERROR(on_table(*item.as_table()));
  return {};
}

core::Result<Profile> read_profile(const toml::table& root, const fs::path& path) {
  TableReader reader(root, path);
  Profile profile;
  profile.name = path.stem().string();
  const toml::node* source = reader.take("source");
  if (source == nullptr || !source->is_table()) reader.fail("a profile needs a [source] table");
  const toml::node* channels = reader.take("channel");
  if (channels == nullptr) reader.fail("a profile needs [[channel]] tables");
  const toml::node* filters = reader.take("filter");
  RAVENCAL_RETURN_IF_ERROR(reader.finish("a profile"));
  RAVENCAL_RETURN_IF_ERROR(read_source(*source->as_table(), path, profile));
  RAVENCAL_RETURN_IF_ERROR(
      for_each_table(channels, "channel", path, [&](const toml::table& table) -> core::Status {
        RAVENCAL_ASSIGN_OR_RETURN(profile.channels.emplace_back(), read_channel(table, path));
        return {};
      }));
  RAVENCAL_RETURN_IF_ERROR(
      for_each_table(filters, "filter", path, [&](const toml::table& table) -> core::Status {
        RAVENCAL_ASSIGN_OR_RETURN(profile.filters.emplace_back(),
                                  read_filter(table, path, "keep", "[[filter]]"));
        return {};
      }));
  return profile;
}

}  // namespace

core::Result<Profile> read_profile_file(const fs::path& path) {
  try {
    const toml::table root = toml::parse_file(path.string());
    return read_profile(root, path);
  } catch (const toml::parse_error& error) {
    const auto line = error.source().begin.line;
    const bool unreadable = line == 0;
    return core::Error{unreadable ? core::ErrorCode::kIo : core::ErrorCode::kData,
                       unreadable
                           ? fmt::format("{}: {}", path.string(), error.description())
                           : fmt::format("{}:{}: {}", path.string(), line, error.description())};
  }
}

}  // namespace ravencal::record
