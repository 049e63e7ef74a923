// SPDX-License-Identifier: Apache-2.0
#include "record/table_load.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.hpp"
#include "record/csv_number.hpp"
#include "record/plausibility.hpp"
#include "record/profile_builtin.hpp"
#include "record/recording_file.hpp"
#include "record/table_binding.hpp"
#include "record/table_truth.hpp"
#include "record/unwrap.hpp"

namespace ravencal::record {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool same_value(const std::string& field, const std::string& wanted) {
  if (field == wanted) return true;
  const auto a = number_of(field);
  const auto b = number_of(wanted);
  return a && b && *a == *b;
}

bool passes(const std::string& field, const ProfileFilter& filter) {
  return std::any_of(filter.keep.begin(), filter.keep.end(),
                     [&](const std::string& wanted) { return same_value(field, wanted); });
}

/// Turns one source into a recording: parse, drop, then what the profile asks for beyond columns.
class TableLoader {
 public:
  TableLoader(const TableSource& source, const Profile& profile, TableBinding binding,
              bool skip_bad)
      : source_(source), profile_(profile), binding_(std::move(binding)), skip_bad_(skip_bad) {}

  core::Result<Recording> load(std::size_t rows);

 private:
  core::Status parse(std::size_t rows);
  core::Status find_times();
  void count_rows();
  [[nodiscard]] std::string why_no_stamp(std::size_t row) const;
  core::Status refuse_stamp(std::size_t row, const std::string& why);
  void spread_times();
  core::Status order_times();
  void apply_filters();
  core::Status drop_rows();
  [[nodiscard]] std::string why_no_row_is_left() const;
  void blank_invalid();
  void make_relative();
  void mark_episodes();
  void describe();

  [[nodiscard]] core::Error error_at(std::size_t row, const std::string& why) const {
    return {core::ErrorCode::kData,
            fmt::format("{}: {}; use --skip-bad to drop such rows", source_.place_of(row), why)};
  }
  /// Drops a row or, without --skip-bad, says why it cannot be used.
  core::Status refuse(const BadRow& bad);
  [[nodiscard]] bool episode_changes(std::size_t row) const {
    return binding_.episode_word && (row == 0 || words_[*binding_.episode_word][row] !=
                                                     words_[*binding_.episode_word][row - 1]);
  }

  const TableSource& source_;
  const Profile& profile_;
  TableBinding binding_;
  bool skip_bad_;
  Recording recording_;
  std::vector<double> time_;
  std::vector<double> fraction_;
  std::vector<std::vector<std::string>> words_;
  std::vector<char> keep_;
  std::vector<BadRow> dropped_;
  std::vector<char> episode_start_;  ///< per row: the first kept one of an episode
};

core::Status TableLoader::refuse(const BadRow& bad) {
  if (!skip_bad_) return error_at(bad.row, bad.why);
  keep_[bad.row] = 0;
  dropped_.push_back(bad);
  return {};
}

core::Status TableLoader::parse(std::size_t rows) {
  const auto channels = static_cast<Eigen::Index>(profile_.channels.size());
  recording_.samples.resize(static_cast<Eigen::Index>(rows), channels);
  keep_.assign(rows, 1);
  episode_start_.assign(rows, 0);
  words_.assign(binding_.word_count, std::vector<std::string>(rows));
  ColumnOutput output;
  for (Eigen::Index c = 0; c < channels; ++c)
    output.numbers.push_back(recording_.samples.col(c).data());
  output.factors = binding_.factors;
  const auto add_time = [&](std::vector<double>& values) {
    values.resize(rows);
    output.numbers.push_back(values.data());
    output.factors.push_back(1.0);
  };
  if (binding_.has_time && !binding_.time_word) add_time(time_);
  if (binding_.has_fraction) add_time(fraction_);
  for (auto& column : words_) output.words.push_back(column.data());
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<BadRow> bad,
                            source_.parse(binding_.columns, output, !skip_bad_));
  for (const BadRow& row : bad) RAVENCAL_RETURN_IF_ERROR(refuse(row));
  for (const auto& [target, source] : binding_.copies) {
    const double factor = output.factors[target] / output.factors[source];
    std::transform(output.numbers[source], output.numbers[source] + rows, output.numbers[target],
                   [factor](double value) { return value * factor; });
  }
  for (std::size_t c = 0; c < profile_.channels.size(); ++c) {
    const ProfileChannel& channel = profile_.channels[c];
    if (channel.offset == 0.0) continue;
    recording_.samples.col(static_cast<Eigen::Index>(c)).array() +=
        core::find_unit(channel.channel.unit)->to_si * channel.offset;
  }
  return {};
}

void TableLoader::count_rows() {
  if (binding_.has_time || !profile_.row_period_stated)
    recording_.meta["assumed_row_period_s"] = fmt::format("{:g}", profile_.row_period_s);
  recording_.t_ns.resize(keep_.size());
  for (std::size_t row = 0; row < keep_.size(); ++row)
    recording_.t_ns[row] = std::llround(static_cast<double>(row) * profile_.row_period_s * kNsPerS);
}

core::Status TableLoader::find_times() {
  const std::span<const std::int64_t> stamps_ns = source_.stamps_ns();
  if (!binding_.has_time && !stamps_ns.empty()) {
    recording_.t_ns.assign(stamps_ns.begin(), stamps_ns.end());
    return {};
  }
  if (!binding_.has_time) {
    count_rows();
    return {};
  }
  StampFields fields{time_, fraction_, {}};
  if (binding_.time_word) fields.words = words_[*binding_.time_word];
  const Stamps stamps = stamps_of(profile_.clock, fields);
  const auto is_missing = [&](std::size_t row) {
    return keep_[row] && !binding_.time_word && std::isnan(time_[row]);
  };
  recording_.t_ns.resize(stamps.size());
  for (std::size_t row = 0; row < stamps.size(); ++row) {
    if (profile_.row_number_if_time_missing && is_missing(row)) {
      count_rows();
      return {};
    }
    if (stamps[row])
      recording_.t_ns[row] = *stamps[row];
    else if (keep_[row])
      RAVENCAL_RETURN_IF_ERROR(refuse_stamp(row, why_no_stamp(row)));
  }
  if (!profile_.clock.drops_bad) return {};
  const std::vector<bool> rises = longest_rising(stamps);
  for (std::size_t row = 0; row < stamps.size(); ++row) {
    if (keep_[row] && !rises[row]) {
      RAVENCAL_RETURN_IF_ERROR(refuse_stamp(
          row, fmt::format("the stamp, {:.9g} s, does not lie between those of its neighbours",
                           static_cast<double>(recording_.t_ns[row]) / kNsPerS)));
    }
  }
  return {};
}

std::string TableLoader::why_no_stamp(std::size_t row) const {
  if (!binding_.time_word) {
    return std::isnan(time_[row])
               ? "no time"
               : fmt::format("time {} {} is out of range", time_[row], profile_.clock.unit);
  }
  return fmt::format("'{}' is no time of the form {}", words_[*binding_.time_word][row],
                     profile_.clock.unit == "date" ? "2025-03-30 01:59:50.005" : "01:59:50.005");
}

/// A bad stamp takes its row where the profile says so, else as any bad value does.
core::Status TableLoader::refuse_stamp(std::size_t row, const std::string& why) {
  if (!profile_.clock.drops_bad) return refuse({row, why});
  keep_[row] = 0;
  dropped_.push_back({row, why});
  return {};
}

void TableLoader::spread_times() {
  const double step_ns =
      profile_.clock.rounded_to *
      (is_written_out(profile_.clock.unit) ? 1.0 : core::find_unit(profile_.clock.unit)->to_si) *
      kNsPerS;
  if (step_ns > 0.0) spread_rounded(recording_.t_ns, std::llround(step_ns));
}

void TableLoader::apply_filters() {
  for (std::size_t f = 0; f < profile_.filters.size(); ++f) {
    const std::vector<std::string>& field = words_[binding_.filter_words[f]];
    for (std::size_t row = 0; row < keep_.size(); ++row) {
      if (!passes(field[row], profile_.filters[f])) keep_[row] = 0;
    }
  }
}

// Time may start again where an episode starts; it then goes on where the last one ended.
core::Status TableLoader::order_times() {
  const auto period_ns = static_cast<std::int64_t>(std::llround(profile_.row_period_s * 1e9));
  std::optional<std::int64_t> last;
  std::int64_t offset = 0;
  bool new_episode = false;
  for (std::size_t row = 0; row < keep_.size(); ++row) {
    new_episode = new_episode || episode_changes(row);
    if (!keep_[row]) continue;
    std::int64_t t_ns = recording_.t_ns[row] + offset;
    const bool backwards = last && t_ns < *last;
    if (backwards && !new_episode && !profile_.time_restarts) {
      RAVENCAL_RETURN_IF_ERROR(refuse(
          {row, fmt::format("time runs backwards, from {:.9g} s to {:.9g} s",
                            static_cast<double>(*last) * 1e-9, static_cast<double>(t_ns) * 1e-9)}));
      continue;
    }
    if (backwards) {
      offset += *last + period_ns - t_ns;
      t_ns = *last + period_ns;
    }
    episode_start_[row] = static_cast<char>(new_episode || (backwards && profile_.time_restarts));
    recording_.t_ns[row] = t_ns;
    last = t_ns;
    new_episode = false;
  }
  return {};
}

std::string TableLoader::why_no_row_is_left() const {
  const std::string text =
      fmt::format("{}: no row is left of {}", source_.path().string(), keep_.size());
  if (dropped_.empty()) return text + ": none passes the profile's filters";
  const auto same = std::count_if(dropped_.begin(), dropped_.end(), [&](const BadRow& bad) {
    return bad.column == dropped_.front().column;
  });
  return fmt::format("{}: {}: {}; {} rows are bad there{}", text,
                     source_.name_of(dropped_.front().row), dropped_.front().why, same,
                     dropped_.front().column ? "; leave the column out of the profile, or state "
                                               "may_be_missing for its channel"
                                             : "");
}

core::Status TableLoader::drop_rows() {
  const auto kept = static_cast<std::size_t>(std::count(keep_.begin(), keep_.end(), 1));
  std::sort(dropped_.begin(), dropped_.end(),
            [](const BadRow& a, const BadRow& b) { return a.row < b.row; });
  if (kept == 0) return core::data_error(why_no_row_is_left());
  if (kept == keep_.size()) return {};
  std::vector<std::size_t> from;
  for (std::size_t row = 0; row < keep_.size(); ++row) {
    if (keep_[row]) from.push_back(row);
  }
  for (const BadRow& bad : dropped_) {
    // The event stands at the last good row before, or at the first row.
    const auto next = std::upper_bound(from.begin(), from.end(), bad.row);
    const std::size_t near = next == from.begin() ? from.front() : *(next - 1);
    recording_.events.push_back(
        {recording_.t_ns[near], "drop", fmt::format("{}: {}", source_.name_of(bad.row), bad.why)});
  }
  const auto compact = [&](auto* data) {
    for (std::size_t i = 0; i < from.size(); ++i) data[i] = std::move(data[from[i]]);
  };
  for (Eigen::Index c = 0; c < recording_.samples.cols(); ++c)
    compact(recording_.samples.col(c).data());
  recording_.samples.conservativeResize(static_cast<Eigen::Index>(kept), Eigen::NoChange);
  compact(recording_.t_ns.data());
  recording_.t_ns.resize(kept);
  compact(episode_start_.data());
  episode_start_.resize(kept);
  for (auto& column : words_) {
    for (std::size_t i = 0; i < from.size(); ++i) std::swap(column[i], column[from[i]]);
    column.resize(kept);
  }
  return {};
}

void TableLoader::blank_invalid() {
  for (std::size_t c = 0; c < profile_.channels.size(); ++c) {
    if (!binding_.condition_words[c]) continue;
    const std::vector<std::string>& field = words_[*binding_.condition_words[c]];
    for (std::size_t row = 0; row < field.size(); ++row) {
      if (passes(field[row], *profile_.channels[c].valid_when)) continue;
      recording_.samples(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c)) = kNaN;
    }
  }
}

void TableLoader::make_relative() {
  for (std::size_t c = 0; c < profile_.channels.size(); ++c) {
    if (!profile_.channels[c].relative) continue;
    auto column = recording_.samples.col(static_cast<Eigen::Index>(c));
    const auto first =
        std::find_if(column.begin(), column.end(), [](double value) { return !std::isnan(value); });
    if (first == column.end()) continue;
    const double origin = *first;
    recording_.meta["origin." + profile_.channels[c].channel.name] = fmt::format("{}", origin);
    column.array() -= origin;
  }
}

void TableLoader::mark_episodes() {
  for (std::size_t row = 0; row < episode_start_.size(); ++row) {
    if (!episode_start_[row]) continue;
    recording_.events.push_back(
        {recording_.t_ns[row], "episode",
         binding_.episode_word
             ? fmt::format("{} = {}", profile_.episode.column, words_[*binding_.episode_word][row])
             : "time starts again"});
  }
}

void TableLoader::describe() {
  recording_.source = source_.path().string();
  recording_.meta["profile"] = profile_.name;
  recording_.meta["source"] = source_.path().filename().string();
  if (!profile_.robot.empty()) recording_.meta["robot"] = profile_.robot;
  if (!profile_.arm.empty()) recording_.meta["arm"] = profile_.arm;
  if (!dropped_.empty()) recording_.meta["dropped_rows"] = std::to_string(dropped_.size());
  for (const auto& [key, value] : profile_.meta) recording_.meta[key] = value;
  recording_.events = profile_.events;
  std::vector<std::string> assumed, implausible;
  for (const ProfileChannel& channel : profile_.channels) {
    recording_.channels.push_back(channel.channel);
    recording_.channels.back().unit = core::find_unit(channel.channel.unit)->si_name;
    if (channel.assumed) assumed.push_back(channel.channel.name);
    if (!channel.plausible) implausible.push_back(channel.channel.name);
  }
  if (!implausible.empty())
    recording_.meta[std::string(kKnownImplausible)] =
        fmt::format("{}", fmt::join(implausible, ", "));
  if (!assumed.empty())
    recording_.meta["assumed_channels"] = fmt::format("{}", fmt::join(assumed, ", "));
}

core::Result<Recording> TableLoader::load(std::size_t rows) {
  describe();
  RAVENCAL_RETURN_IF_ERROR(check_channels(recording_.channels, source_.path()));
  RAVENCAL_RETURN_IF_ERROR(parse(rows));
  RAVENCAL_RETURN_IF_ERROR(find_times());
  apply_filters();
  RAVENCAL_RETURN_IF_ERROR(order_times());
  RAVENCAL_RETURN_IF_ERROR(drop_rows());
  spread_times();
  blank_invalid();
  unwrap_channels(recording_, profile_, episode_start_);
  make_relative();
  mark_episodes();
  if (profile_.reference_first) reference_truth(recording_, episode_start_);
  blank_early_truth(recording_, profile_.truth_from_s);
  if (profile_.homed)
    recording_.events.push_back({recording_.t_ns.front(), "homing", "the profile says so"});
  std::stable_sort(recording_.events.begin(), recording_.events.end(),
                   [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
  if (!dropped_.empty()) recording_.meta["dropped_rows"] = std::to_string(dropped_.size());
  return std::move(recording_);
}

}  // namespace

core::Result<Recording> load_source(const TableSource& source, Profile profile,
                                    const LoadOptions& options) {
  if (profile.name == "generic") {
    RAVENCAL_RETURN_IF_ERROR(check_names_differ(source));
    RAVENCAL_RETURN_IF_ERROR(add_generic_channels(profile, source.names(), source.place_of_names(),
                                                  !source.stamps_ns().empty()));
  }
  RAVENCAL_ASSIGN_OR_RETURN(TableBinding binding, bind_columns(profile, source));
  RAVENCAL_ASSIGN_OR_RETURN(const std::size_t rows, source.rows(binding.columns));
  if (rows == 0) {
    return core::data_error(
        fmt::format("{}: no rows; the file has columns and no values", source.path().string()));
  }
  return TableLoader(source, profile, std::move(binding), options.skip_bad).load(rows);
}

}  // namespace ravencal::record
