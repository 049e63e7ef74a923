// SPDX-License-Identifier: Apache-2.0
//
// A profile says which column of a foreign file is which channel (shared/FORMATS.md).
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "record/channel.hpp"
#include "record/recording.hpp"
#include "record/stamps.hpp"

namespace ravencal::record {

/// A column and the values that it must have, e.g. vision_ok = 1 or axis = "x". Numbers are
/// compared as numbers, words as words.
struct ProfileFilter {
  std::string column;                ///< header name, if the source has a header
  std::optional<std::size_t> index;  ///< zero-based column, if it has none
  std::vector<std::string> keep;     ///< any of these
};

/// Where one channel comes from: a header name or a zero-based column index.
struct ProfileChannel {
  Channel channel;  ///< unit = the file's unit
  std::string column;
  std::optional<std::size_t> index;
  double scale = 1.0;           ///< SI value = unit * (scale * file value + offset); not 0
  double offset = 0.0;          ///< in the file's unit
  double wraps_at = 0.0;        ///< the file's values start again after so much; 0: they do not
  bool may_be_missing = false;  ///< "nan" and an empty field mean a lost value (NaN)
  bool relative = false;        ///< minus the first row's value, which meta `origin.NAME` keeps
  std::optional<ProfileFilter> valid_when;  ///< elsewhere the value is NaN
  bool assumed = false;   ///< nothing in the file says so: nobody has confirmed it yet
  bool plausible = true;  ///< false: right as it is, whatever plausibility.hpp says of it
};

struct Profile {
  std::string name;
  std::string robot;           ///< for the recording's metadata
  std::string format = "csv";  ///< "csv" or "bag"
  bool header = true;
  std::string time_column;  ///< header name of the time; empty: row number
  std::optional<std::size_t> time_index;
  Clock clock;
  std::string fraction_column;  ///< added to the time: nanoseconds beside seconds; may be empty
  std::optional<std::size_t> fraction_index;
  double row_period_s = 0.01;      ///< used when the source has no time
  bool row_period_stated = false;  ///< it is the profile's own, and not said to be assumed
  std::size_t column_count = 0;    ///< columns that every row must have; 0 = those of the first row
  bool row_number_if_time_missing = false;  ///< a time of nan anywhere: row numbers everywhere
  bool time_restarts = false;    ///< time running backwards begins an episode, is no error
  ProfileFilter episode;         ///< a new value begins a new episode (an event); may be unset
  bool reference_first = false;  ///< truth - estimate becomes 0 at the start of each episode
  double truth_from_s = 0.0;     ///< the truth of the time before is lost: transient of a start
  bool homed = false;            ///< the robot homed before the recording: an event at its start
  std::string state_topic;       ///< bag: topic of raven_2/raven_state; empty: the only one
  std::string truth_topic;       ///< bag: topic of the joint encoders; empty: ext_jpos
  std::string arm;  ///< calibrated arm ("gold" or "green"); never guessed from slot order
  std::vector<ProfileChannel> channels;
  std::vector<ProfileFilter> filters;       ///< only rows that pass all of them are kept
  std::map<std::string, std::string> meta;  ///< of the recording that was exported
  std::vector<Event> events;                ///< likewise
};

/// Which arm of a two-arm source is the calibrated one.
struct ProfileOptions {
  std::string arm = "gold";
};

/// A built-in profile ("raven2", "raven2-bag", "raven2-bag-truth", "generic") by name, or a profile
/// file by path.
/// `generic` has no channels of its own: the reader takes them from a header of `name_unit` words.
core::Result<Profile> load_profile(std::string_view name_or_path,
                                   const ProfileOptions& options = {});

/// Fills the channels of a profile from names as `generic` reads them, `estimate.elbow_rad`; errors
/// name `place` and the word. A column of time is needed unless rows have stamps.
core::Status add_generic_channels(Profile& profile, std::span<const std::string> header,
                                  const std::string& place, bool has_stamps);

/// The profile that `export` writes beside a CSV of every channel: FILE.csv.toml.
std::filesystem::path profile_beside(const std::filesystem::path& csv);

/// What it holds: which column is which channel, metadata and events, so that an import gives the
/// same recording.
std::string profile_of(const Recording& recording);

}  // namespace ravencal::record
