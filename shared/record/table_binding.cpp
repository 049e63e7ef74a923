// SPDX-License-Identifier: Apache-2.0
#include "record/table_binding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "core/known_words.hpp"
#include "core/units.hpp"

namespace ravencal::record {
namespace {

constexpr std::size_t kMostNamesListed = 40;  // of an error; no source: a choice

core::Error called_twice(const TableSource& source, const std::string& name, std::size_t first,
                         std::size_t second) {
  return core::data_error(
      fmt::format("{}: columns {} and {} are both called '{}'; rename one, or bind them by `index` "
                  "in a profile",
                  source.place_of_names(), first + 1, second + 1, name));
}

class Binder {
 public:
  Binder(const Profile& profile, const TableSource& source)
      : profile_(profile), source_(source), names_(source.names()) {}
  core::Result<TableBinding> bind();

 private:
  core::Result<std::size_t> find(const std::string& name, std::optional<std::size_t> index) const;
  core::Status bind_number(const std::string& column, std::optional<std::size_t> index,
                           const std::string& name, bool may_be_missing);
  core::Status bind_channel(const ProfileChannel& channel);
  core::Status bind_time();
  core::Result<std::size_t> bind_word(const ProfileFilter& filter);
  core::Error wrong(std::string why) const {
    return {core::ErrorCode::kData, fmt::format("{}: {}", source_.place_of_names(), why)};
  }

  const Profile& profile_;
  const TableSource& source_;
  const std::vector<std::string>& names_;
  TableBinding binding_;
  std::size_t numbers_ = 0;
};

core::Result<std::size_t> Binder::find(const std::string& name,
                                       std::optional<std::size_t> index) const {
  if (index && *index < names_.size()) return *index;
  if (index) {
    return wrong(fmt::format("{} columns, but profile {} reads column {}", names_.size(),
                             profile_.name, *index + 1));
  }
  const auto it = std::find(names_.begin(), names_.end(), name);
  if (it != names_.end()) {
    const auto again = std::find(it + 1, names_.end(), name);
    const auto at = static_cast<std::size_t>(it - names_.begin());
    if (again == names_.end()) return at;
    return called_twice(source_, name, at, static_cast<std::size_t>(again - names_.begin()));
  }
  const std::string why = source_.why_left_out(name);
  if (!why.empty()) return wrong(fmt::format("'{}' cannot be a column: {}", name, why));
  const auto meant = core::likely_meant(name, names_);
  return wrong(fmt::format(
      "no column '{}', which profile {} needs{}", name, profile_.name,
      names_.size() <= kMostNamesListed
          ? core::instead_of(name, names_)
          : fmt::format("; {}`ravencal info` lists the {} that there are",
                        meant ? fmt::format("did you mean '{}'? ", *meant) : "", names_.size())));
}

core::Status Binder::bind_number(const std::string& column_name, std::optional<std::size_t> index,
                                 const std::string& name, bool may_be_missing) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::size_t at, find(column_name, index));
  BoundColumn& column = binding_.columns[at];
  const std::size_t target = numbers_++;
  if (column.number) {
    binding_.copies.emplace_back(target, *column.number);
    column.may_be_missing = column.may_be_missing && may_be_missing;
  } else {
    column.number = target;
    column.name = name;
    column.may_be_missing = may_be_missing;
  }
  return {};
}

core::Result<std::size_t> Binder::bind_word(const ProfileFilter& filter) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::size_t at, find(filter.column, filter.index));
  BoundColumn& column = binding_.columns[at];
  if (!column.word) column.word = binding_.word_count++;
  return *column.word;
}

core::Status Binder::bind_channel(const ProfileChannel& channel) {
  RAVENCAL_RETURN_IF_ERROR(
      bind_number(channel.column, channel.index, channel.channel.name, channel.may_be_missing));
  const auto unit = core::find_unit(channel.channel.unit);
  if (!unit) {
    return wrong(fmt::format("channel {}: unknown unit '{}'{}", channel.channel.name,
                             channel.channel.unit,
                             core::instead_of(channel.channel.unit, core::unit_names())));
  }
  binding_.factors.push_back(unit->to_si * channel.scale);
  binding_.condition_words.emplace_back();
  if (channel.valid_when) {
    RAVENCAL_ASSIGN_OR_RETURN(binding_.condition_words.back(), bind_word(*channel.valid_when));
  }
  return {};
}

core::Status Binder::bind_time() {
  const Clock& clock = profile_.clock;
  if (is_written_out(clock.unit)) {
    RAVENCAL_ASSIGN_OR_RETURN(
        binding_.time_word,
        bind_word({.column = profile_.time_column, .index = profile_.time_index, .keep = {}}));
    return {};
  }
  const bool may_be_missing = profile_.row_number_if_time_missing || clock.drops_bad;
  RAVENCAL_RETURN_IF_ERROR(
      bind_number(profile_.time_column, profile_.time_index, "time", may_be_missing));
  binding_.has_fraction = profile_.fraction_index || !profile_.fraction_column.empty();
  if (!binding_.has_fraction) return {};
  return bind_number(profile_.fraction_column, profile_.fraction_index, "time_fraction",
                     may_be_missing);
}

core::Result<TableBinding> Binder::bind() {
  if (profile_.column_count != 0 && names_.size() != profile_.column_count) {
    return wrong(fmt::format("{} columns, but profile {} needs {}", names_.size(), profile_.name,
                             profile_.column_count));
  }
  binding_.columns.resize(names_.size());
  for (const ProfileChannel& channel : profile_.channels) {
    RAVENCAL_RETURN_IF_ERROR(bind_channel(channel));
  }
  binding_.has_time = profile_.time_index || !profile_.time_column.empty();
  if (binding_.has_time) RAVENCAL_RETURN_IF_ERROR(bind_time());
  for (const ProfileFilter& filter : profile_.filters) {
    RAVENCAL_ASSIGN_OR_RETURN(binding_.filter_words.emplace_back(), bind_word(filter));
  }
  if (!profile_.episode.column.empty() || profile_.episode.index) {
    RAVENCAL_ASSIGN_OR_RETURN(binding_.episode_word, bind_word(profile_.episode));
  }
  return std::move(binding_);
}

}  // namespace

core::Status check_names_differ(const TableSource& source) {
  std::map<std::string_view, std::size_t> first;
  for (std::size_t i = 0; i < source.names().size(); ++i) {
    const std::string& name = source.names()[i];
    const auto [it, is_new] = first.emplace(name, i);
    if (!is_new && !name.empty()) return called_twice(source, name, it->second, i);
  }
  return {};
}

core::Result<TableBinding> bind_columns(const Profile& profile, const TableSource& source) {
  return Binder(profile, source).bind();
}

}  // namespace ravencal::record
