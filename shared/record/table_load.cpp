// SPDX-License-Identifier: Apache-2.0
#include "record/table_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.hpp"
#include "record/csv_number.hpp"
#include "record/profile_builtin.hpp"
#include "record/recording_file.hpp"
#include "record/table_binding.hpp"

namespace ravencal::record {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// int64 nanoseconds reach 292 years; leave room for sums.
constexpr double kMaxTimeNs = 9e18;

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
  core::Status order_times();
  void apply_filters();
  core::Status drop_rows();
  [[nodiscard]] std::string why_no_row_is_left() const;
  void blank_invalid();
  void make_relative();
  void mark_episodes();
  void reference_first();
  void blank_early_truth();
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
  if (binding_.has_time) {
    time_.resize(rows);
    output.numbers.push_back(time_.data());
    output.factors.push_back(1.0);
  }
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

core::Status TableLoader::find_times() {
  const std::span<const std::int64_t> stamps_ns = source_.stamps_ns();
  if (!binding_.has_time && !stamps_ns.empty()) {
    recording_.t_ns.assign(stamps_ns.begin(), stamps_ns.end());
    return {};
  }
  const auto missing = [&](std::size_t row) { return keep_[row] && std::isnan(time_[row]); };
  bool by_row_number = !binding_.has_time;
  for (std::size_t row = 0; row < time_.size() && !by_row_number; ++row)
    by_row_number = missing(row);
  double to_ns = core::find_unit(profile_.time_unit)->to_si * 1e9;
  if (by_row_number) {
    to_ns = profile_.row_period_s * 1e9;
    if (binding_.has_time || !profile_.row_period_stated)
      recording_.meta["assumed_row_period_s"] = fmt::format("{:g}", profile_.row_period_s);
    time_.resize(keep_.size());
    for (std::size_t row = 0; row < time_.size(); ++row) time_[row] = static_cast<double>(row);
  }
  recording_.t_ns.resize(time_.size());
  for (std::size_t row = 0; row < time_.size(); ++row) {
    const double t_ns = std::round(time_[row] * to_ns);
    if (std::abs(t_ns) < kMaxTimeNs) {
      recording_.t_ns[row] = static_cast<std::int64_t>(t_ns);
    } else if (keep_[row]) {
      RAVENCAL_RETURN_IF_ERROR(
          refuse({row, fmt::format("time {} {} is out of range", time_[row], profile_.time_unit)}));
    }
  }
  return {};
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

void TableLoader::reference_first() {
  std::vector<std::size_t> bounds = {0};
  for (std::size_t row = 1; row < episode_start_.size(); ++row) {
    if (episode_start_[row]) bounds.push_back(row);
  }
  bounds.push_back(episode_start_.size());
  for (const std::string& joint : recording_.calibratable_joints()) {
    const auto truth = *recording_.column(Role::kJointTruth, joint);
    const auto estimate = *recording_.column(Role::kJointEstimate, joint);
    for (std::size_t e = 0; e + 1 < bounds.size(); ++e) {
      const auto first = static_cast<Eigen::Index>(bounds[e]);
      const auto count = static_cast<Eigen::Index>(bounds[e + 1]) - first;
      auto true_values = recording_.samples.col(truth).segment(first, count);
      const auto believed = recording_.samples.col(estimate).segment(first, count);
      for (Eigen::Index i = 0; i < count; ++i) {
        const double difference = true_values(i) - believed(i);
        if (std::isnan(difference)) continue;
        true_values.array() -= difference;
        break;
      }
    }
  }
}

void TableLoader::blank_early_truth() {
  if (!(profile_.truth_from_s > 0.0)) return;
  const std::int64_t from_ns = recording_.t_ns.front() + std::llround(profile_.truth_from_s * 1e9);
  const auto first = std::lower_bound(recording_.t_ns.begin(), recording_.t_ns.end(), from_ns);
  for (std::size_t c = 0; c < recording_.channels.size(); ++c) {
    if (recording_.channels[c].role != Role::kJointTruth) continue;
    recording_.samples.col(static_cast<Eigen::Index>(c))
        .head(first - recording_.t_ns.begin())
        .setConstant(kNaN);
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
  for (const ProfileChannel& channel : profile_.channels) {
    recording_.channels.push_back(channel.channel);
    recording_.channels.back().unit = core::find_unit(channel.channel.unit)->si_name;
  }
}

core::Result<Recording> TableLoader::load(std::size_t rows) {
  describe();
  RAVENCAL_RETURN_IF_ERROR(check_channels(recording_.channels, source_.path()));
  RAVENCAL_RETURN_IF_ERROR(parse(rows));
  RAVENCAL_RETURN_IF_ERROR(find_times());
  apply_filters();
  RAVENCAL_RETURN_IF_ERROR(order_times());
  RAVENCAL_RETURN_IF_ERROR(drop_rows());
  blank_invalid();
  make_relative();
  mark_episodes();
  if (profile_.reference_first) reference_first();
  blank_early_truth();
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
