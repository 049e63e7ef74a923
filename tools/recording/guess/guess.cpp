// SPDX-License-Identifier: Apache-2.0
#include "guess/guess.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "guess/columns.hpp"
#include "record/relation.hpp"

namespace ravencal::guess {
core::Result<Guess> guess_profile(const record::Table& table,
                                  const std::vector<std::string>& joints) {
  const auto failed = [&](const std::string& why) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: {}", table.path.string(), why)};
  };
  Guess guess;
  Columns columns = columns_of(table, joints, guess);
  if (guess.rows < static_cast<std::size_t>(record::kFewestRows))
    return failed(
        fmt::format("{} rows; a guess needs at least {}", guess.rows, record::kFewestRows));
  find_time(table, columns, guess);
  find_wraps(columns);
  find_quantities(columns);
  settle_wraps(columns);
  find_position_units(columns);
  find_joints(columns, joints);
  find_other_units(columns);
  find_roles(columns, guess);
  guess.questions = columns.questions;
  const core::Status fits = record::check_channel_count(guess.channels.size(), table.path);
  if (!fits.ok())
    return core::data_error(fits.error().message +
                            "; take columns out of the table, or write a profile of those that "
                            "you need by hand (shared/FORMATS.md, Profiles)");
  const bool any =
      std::any_of(guess.channels.begin(), guess.channels.end(), [](const auto& channel) {
        return channel.role != "feature" && channel.role != "temperature";
      });
  if (any) return guess;
  std::vector<std::string> names;
  for (const record::TableColumn& column : table.columns) names.push_back(column.name);
  return failed(fmt::format(
      "no joint has a position with a command, an effort or another encoder beside it; the columns "
      "are: "
      "{}. Write a profile by hand (shared/FORMATS.md, Profiles), or name columns such as "
      "elbow_position_rad",
      fmt::join(names, ", ")));
}

}  // namespace ravencal::guess
