// SPDX-License-Identifier: Apache-2.0
//
// The clocks of files from elsewhere: from the guess to the imported recording.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

#include "core/whole_file.hpp"
#include "exchange/load.hpp"
#include "exchange/table_file.hpp"
#include "guess/guess.hpp"
#include "unit/record/scratch.hpp"

namespace ravencal::guess {
namespace {

namespace fs = std::filesystem;

constexpr int kRows = 3000;
constexpr double kRateHz = 160.0;

/// Writes a table whose first columns are the time, guesses its profile and imports it.
class Clock : public ::testing::Test {
 protected:
  record::Recording imported(const std::string& header,
                             const std::function<std::string(int)>& time) {
    std::string text = header + ",elbow_pos_rad,elbow_vel_rad_s,elbow_torque_Nm\n";
    for (int row = 0; row < kRows; ++row) {
      const double t_s = row / kRateHz;
      text += fmt::format("{},{:.6f},{:.6f},{:.6f}\n", time(row), std::sin(2.0 * t_s),
                          2.0 * std::cos(2.0 * t_s), std::cos(2.0 * t_s) - std::sin(2.0 * t_s));
    }
    EXPECT_TRUE(core::write_whole_file(path("run.csv"), text).ok());
    const auto table = exchange::read_table(path("run.csv"), {});
    EXPECT_TRUE(table.ok()) << table.error().message;
    const auto guess = guess_profile(*table, {});
    EXPECT_TRUE(guess.ok()) << guess.error().message;
    profile_ = profile_text(*guess, *table);
    description_ = describe(*guess, *table);
    return loaded();
  }
  /// The same table without the profile's first `assumed = true`.
  record::Recording confirmed() {
    const auto word = profile_.find("assumed = true");
    EXPECT_NE(word, std::string::npos) << profile_;
    profile_.erase(word, profile_.find('\n', word) - word);
    return loaded();
  }
  record::Recording loaded() {
    EXPECT_TRUE(core::write_whole_file(path("run.toml"), profile_).ok());
    record::LoadOptions options;
    options.profile = path("run.toml").string();
    auto recording = exchange::load_recording(path("run.csv").string(), options);
    EXPECT_TRUE(recording.ok()) << recording.error().message << profile_;
    return recording.ok() ? std::move(*recording) : record::Recording();
  }
  static double rate_hz(const record::Recording& recording) {
    return static_cast<double>(recording.rows() - 1) * 1e9 /
           static_cast<double>(recording.t_ns.back() - recording.t_ns.front());
  }
  static std::size_t drops(const record::Recording& recording) {
    return static_cast<std::size_t>(
        std::count_if(recording.events.begin(), recording.events.end(),
                      [](const record::Event& event) { return event.kind == "drop"; }));
  }

  [[nodiscard]] fs::path path(std::string_view name) const { return scratch_ / name; }

  record::testing::Scratch scratch_;
  std::string profile_, description_;
};

TEST_F(Clock, KeepsItsRateWhereSomeStampsAreBad) {
  for (const char* bad : {"", "nan", "0.01", "1e6", "-5"}) {
    const record::Recording recording = imported("t_s", [&](int row) {
      return row == 40 || row == 1900 ? std::string(bad) : fmt::format("{:.5f}", row / kRateHz);
    });
    EXPECT_EQ(recording.rows(), kRows - 2) << bad;
    EXPECT_EQ(drops(recording), 2U) << bad;
    EXPECT_EQ(recording.t_ns[100] - recording.t_ns[99], 6'250'000) << bad;
    EXPECT_FALSE(recording.meta.contains("assumed_row_period_s"));
  }
}

TEST_F(Clock, ReadsTwoPartsDatesClocksAndCounters) {
  const auto ns_of = [](int row) { return static_cast<std::int64_t>(row) * 6'250'000; };
  struct Case {
    const char* header;
    std::function<std::string(int)> time;
  };
  const Case cases[] = {
      {"sec,nanosec",
       [&](int row) {
         return fmt::format("{},{}", 1732900000 + ns_of(row) / 1'000'000'000,
                            ns_of(row) % 1'000'000'000);
       }},
      {"header.stamp.secs,header.stamp.nsecs",
       [&](int row) {
         const std::int64_t ns = ns_of(row) + 999'000'000;
         return fmt::format("{},{}", ns / 1'000'000'000, ns % 1'000'000'000);
       }},
      {"timestamp",
       [&](int row) {
         const std::int64_t us = ns_of(row) / 1000;
         return fmt::format("2026-12-31T23:59:{:02d}.{:06d}Z", 40 + us / 1'000'000, us % 1'000'000);
       }},
      {"clock",
       [&](int row) {
         const std::int64_t us = ns_of(row) / 1000 + 86'395'000'000;
         return fmt::format("{:02d}:{:02d}:{:02d}.{:06d}", us / 3'600'000'000 % 24,
                            us / 60'000'000 % 60, us / 1'000'000 % 60, us % 1'000'000);
       }},
      {"micros",
       [&](int row) {
         return fmt::format("{}", (ns_of(row) / 1000 + 4'290'000'000) % 4'294'967'296);
       }},
      {"timer_us", [&](int row) { return fmt::format("{}", ns_of(row) / 1000 % 65'536); }},
      {"millis", [&](int row) { return fmt::format("{}", ns_of(row) / 1e6); }},
  };
  for (const Case& c : cases) {
    const record::Recording recording = imported(c.header, c.time);
    EXPECT_EQ(recording.rows(), kRows) << c.header << profile_;
    EXPECT_NEAR(rate_hz(recording), kRateHz, 0.001) << c.header << profile_;
  }
}

TEST_F(Clock, SpreadsStampsOfTwoDecimals) {
  const record::Recording recording =
      imported("t_s", [](int row) { return fmt::format("{:.2f}", row / kRateHz); });
  ASSERT_EQ(recording.rows(), kRows);
  EXPECT_NEAR(rate_hz(recording), kRateHz, 0.2);
  for (Eigen::Index row = 1; row < recording.rows(); ++row) {
    const auto at = static_cast<std::size_t>(row);
    ASSERT_NEAR(static_cast<double>(recording.t_ns[at] - recording.t_ns[at - 1]), 6.25e6, 1e5);
  }
}

TEST_F(Clock, ReadsRunsOneBehindTheOtherAsEpisodes) {
  const record::Recording recording =
      imported("t_s", [](int row) { return fmt::format("{:.5f}", row % 1000 / kRateHz); });
  EXPECT_EQ(recording.rows(), kRows);
  EXPECT_NE(profile_.find("time_restarts = true"), std::string::npos);
}

TEST_F(Clock, AnAssumedPeriodIsSaidUntilItIsConfirmed) {
  const auto counted = imported("note", [](int) { return std::string("x"); });
  EXPECT_EQ(counted.meta.at("assumed_row_period_s"), "0.01");
  EXPECT_FALSE(confirmed().meta.contains("assumed_row_period_s"));
}

TEST_F(Clock, AnAssumedUnitOfTheTimeIsSaidUntilItIsConfirmed) {
  const auto in_ms = [](double from_s) {
    return [from_s](int row) { return fmt::format("{:.2f}", 1e3 * (from_s + row / kRateHz)); };
  };
  EXPECT_EQ(imported("time", in_ms(3.5)).meta.at("assumed_time_unit"), "ms");
  EXPECT_NE(description_.find("time time in ms (assumed)"), std::string::npos) << description_;
  EXPECT_FALSE(confirmed().meta.contains("assumed_time_unit"));
  EXPECT_FALSE(imported("t_ms", in_ms(3.5)).meta.contains("assumed_time_unit"));
  EXPECT_FALSE(imported("time", in_ms(1.78e9)).meta.contains("assumed_time_unit"))
      << "it can only be a date";
  EXPECT_EQ(profile_.find("# Check"), std::string::npos) << profile_;
}

TEST_F(Clock, AnAssumedUnitIsNamedInTheRecording) {
  const auto stated = imported("t_s", [](int row) { return fmt::format("{:.5f}", row / kRateHz); });
  EXPECT_FALSE(stated.meta.contains("assumed_channels"));
  std::string text = "t_s,q,tau\n";
  for (int row = 0; row < kRows; ++row)
    text += fmt::format("{:.5f},{:.6f},{:.6f}\n", row / kRateHz, std::sin(row / 50.0),
                        std::cos(row / 50.0));
  ASSERT_TRUE(core::write_whole_file(path("plain.csv"), text).ok());
  const auto table = exchange::read_table(path("plain.csv"), {});
  ASSERT_TRUE(table.ok());
  const auto guess = guess_profile(*table, {});
  ASSERT_TRUE(guess.ok());
  ASSERT_TRUE(core::write_whole_file(path("plain.toml"), profile_text(*guess, *table)).ok());
  record::LoadOptions options;
  options.profile = path("plain.toml").string();
  const auto assumed = exchange::load_recording(path("plain.csv").string(), options);
  ASSERT_TRUE(assumed.ok()) << assumed.error().message;
  EXPECT_EQ(assumed->meta.at("assumed_channels"), "joint.position, joint.torque");
}

}  // namespace
}  // namespace ravencal::guess
