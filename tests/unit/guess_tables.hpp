// SPDX-License-Identifier: Apache-2.0
//
// Tables of one joint's motion, for tests of the guess.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "guess/guess.hpp"

namespace ravencal::guess {

inline constexpr double kStepS = 0.004;

/// One joint's motion: two sines, in rad, with its derivatives.
inline double motion(double t_s) {
  return 0.8 * std::sin(1.3 * t_s) + 0.3 * std::sin(4.1 * t_s + 0.5);
}
inline double velocity(double t_s) {
  return 0.8 * 1.3 * std::cos(1.3 * t_s) + 0.3 * 4.1 * std::cos(4.1 * t_s + 0.5);
}
inline double acceleration(double t_s) {
  return -0.8 * 1.69 * std::sin(1.3 * t_s) - 0.3 * 16.81 * std::sin(4.1 * t_s + 0.5);
}
inline double effort(double t_s) {
  const double v = velocity(t_s);
  return 0.2 * acceleration(t_s) + 0.5 * v + 0.4 * ((v > 0.0) - (v < 0.0)) +
         0.6 * std::sin(motion(t_s));
}

using Signal = std::function<double(double t_s)>;
inline record::Table table_of(const std::vector<std::pair<std::string, Signal>>& columns) {
  record::Table table;
  table.path = "run.csv";
  for (const auto& [name, signal] : columns) {
    record::TableColumn column;
    column.name = name;
    for (int row = 0; row < 5000; ++row) column.values.push_back(signal(kStepS * row));
    table.columns.push_back(std::move(column));
  }
  return table;
}
inline const Signal kSeconds = [](double t_s) { return t_s; };
inline Signal times(double factor, Signal signal) {
  return [factor, signal = std::move(signal)](double t_s) { return factor * signal(t_s); };
}

inline const GuessedChannel& channel_of(const Guess& guess, const record::Table& table,
                                        const std::string& column) {
  static const GuessedChannel kNone;
  for (const GuessedChannel& channel : guess.channels) {
    if (table.columns[channel.column].name == column) return channel;
  }
  ADD_FAILURE() << "no channel of " << column;
  return kNone;
}
inline bool asks(const Guess& guess, const std::string& word) {
  return std::any_of(guess.questions.begin(), guess.questions.end(),
                     [&](const std::string& q) { return q.find(word) != std::string::npos; });
}

TEST(GuessProfile, OfMoreChannelsThanARecordingHoldsSaysSo) {
  record::Table table;
  table.path = "wide.csv";
  for (std::size_t c = 0; c < record::kMostChannels + 2; ++c) {
    record::TableColumn& column = table.columns.emplace_back();
    column.name = c == 0 ? "t_s" : fmt::format("j{}_position_rad", c);
    for (int row = 0; row < 40; ++row)
      column.values.push_back(c == 0 ? kStepS * row : motion(kStepS * row + 0.01 * double(c)));
  }
  const auto guess = guess_profile(table, {});
  ASSERT_FALSE(guess.ok());
  EXPECT_TRUE(guess.error().message.starts_with(
      "wide.csv: 2000 channels; a recording holds at most 1999; take columns out"))
      << guess.error().message;
}

}  // namespace ravencal::guess
