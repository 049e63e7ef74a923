// SPDX-License-Identifier: Apache-2.0
//
// Positions that start again after a turn.
#include "record/unwrap.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/whole_file.hpp"
#include "record/load.hpp"
#include "unit/record/scratch.hpp"

namespace ravencal::record {
namespace {

double wrapped(double value, double lowest, double turn) {
  return value - turn * std::floor((value - lowest) / turn);
}

TEST(Unwrap, CountsOnWhateverTheWidthTheLostRowsAndAWildValue) {
  std::mt19937_64 random(11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int trial = 0; trial < 4000; ++trial) {
    const double turn = std::exp(uniform(std::log(0.1), std::log(1e7)));
    const double lowest = uniform(-1.0, 0.0) * turn;
    // At most 0.06 turns a row, and at most 6 rows lost in sequence.
    double speed = 0.0;
    std::vector<double> truth = {lowest + uniform(0.0, 1.0) * turn};
    for (int row = 1; row < 500; ++row) {
      speed = std::clamp(speed + uniform(-0.01, 0.01), -0.06, 0.06);
      truth.push_back(truth.back() + speed * turn);
    }
    std::vector<double> values, kept;
    std::vector<std::int64_t> t_ns;
    const double share_lost = uniform(0.0, 0.3);
    int lost = 0;
    for (std::size_t row = 0; row < truth.size(); ++row) {
      if (row > 0 && lost < 6 && uniform(0.0, 1.0) < share_lost) {
        ++lost;
        // A lost row is no row, or one without a value.
        if (uniform(0.0, 1.0) < 0.5) continue;
        values.push_back(std::numeric_limits<double>::quiet_NaN());
      } else {
        lost = 0;
        values.push_back(wrapped(truth[row], lowest, turn));
      }
      kept.push_back(truth[row]);
      t_ns.push_back(static_cast<std::int64_t>(row) * 5'000'000);
    }
    // Of 4, 3 lie anywhere in the counter's range and 1 far outside it. No row is lost beside it.
    auto wild = static_cast<std::size_t>(uniform(5.0, double(values.size()) / 2.0));
    const auto whole = [&](std::size_t row) {
      return t_ns[row + 3] - t_ns[row - 3] == 6 * 5'000'000 &&
             std::none_of(values.begin() + std::ptrdiff_t(row) - 3,
                          values.begin() + std::ptrdiff_t(row) + 4,
                          [](double value) { return std::isnan(value); });
    };
    while (wild + 5 < values.size() && !whole(wild)) ++wild;
    if (trial % 2 == 0)
      values[wild] = trial % 8 == 0 ? 50.0 * turn : lowest + uniform(0.0, 1.0) * turn;
    unwrap(values, t_ns, turn);
    for (std::size_t row = 0; row < values.size(); ++row) {
      if (std::isnan(values[row]) || (trial % 2 == 0 && row == wild)) continue;
      ASSERT_NEAR(values[row], kept[row], 1e-6 * turn)
          << "trial " << trial << ", row " << row << ", wild " << wild << ", turn " << turn;
    }
  }
}

TEST(Unwrap, SaysHowOften) {
  std::vector<double> values;
  std::vector<std::int64_t> t_ns;
  for (int row = 0; row < 300; ++row) {
    values.push_back(std::fmod(700.0 + 13.0 * (row < 200 ? row : 400 - row), 1000.0));
    t_ns.push_back(row);
  }
  values[100] = 1e5;
  EXPECT_EQ(unwrap(values, t_ns, 1000.0), 4U);
  EXPECT_EQ(unwrap(values, t_ns, 1000.0), 0U);
  EXPECT_EQ(values[199], 700.0 + 13.0 * 199);
}

/// Imports a table of a wrapping angle, its command and its truth, through a profile.
class UnwrapChannels : public ::testing::Test {
 protected:
  Recording load(const std::string& source, const std::string& channels, const std::string& rows) {
    EXPECT_TRUE(core::write_whole_file(scratch_ / "run.csv", rows).ok());
    EXPECT_TRUE(
        core::write_whole_file(scratch_ / "run.toml", "[source]\n" + source + channels).ok());
    LoadOptions options;
    options.profile = (scratch_ / "run.toml").string();
    auto recording = load_recording(scratch_ / "run.csv", options);
    EXPECT_TRUE(recording.ok()) << recording.error().message;
    return recording.ok() ? std::move(*recording) : Recording();
  }
  static std::vector<std::string> said(const Recording& recording) {
    std::vector<std::string> details;
    for (const Event& event : recording.events)
      if (event.kind == "unwrapped") details.push_back(event.detail);
    return details;
  }
  testing::Scratch scratch_;
};

TEST_F(UnwrapChannels, InTheFilesUnitWithScaleSignOffsetAndOrigin) {
  std::string rows = "t,ticks,enc\n";
  for (int row = 0; row < 50; ++row)
    rows += fmt::format("{},{},{}\n", 0.01 * row, (900 + 17 * row) % 1024,
                        wrapped(100.0 + 9.0 * row, -180.0, 360.0));
  const Recording recording = load("time = \"t\"\n", R"(
[[channel]]
name = "j.estimate"
column = "ticks"
unit = "deg"
scale = -0.3515625
offset = 5.0
wraps_at = 1024
role = "joint_estimate"
joint = "j"
[[channel]]
name = "j.truth"
column = "enc"
unit = "deg"
negate = true
wraps_at = 360.0
relative = true
role = "joint_truth"
joint = "j"
)",
                                   rows);
  ASSERT_EQ(recording.rows(), 50);
  const double deg = std::numbers::pi / 180.0;
  for (int row = 0; row < 50; ++row) {
    EXPECT_NEAR(recording.samples(row, 0), deg * (5.0 - 0.3515625 * (900 + 17 * row)), 1e-9);
    EXPECT_NEAR(recording.samples(row, 1), -deg * 9.0 * row, 1e-9);
  }
  EXPECT_EQ(said(recording),
            (std::vector<std::string>{"j.estimate wraps at 1024 in the file; unwrapped 1 time",
                                      "j.truth wraps at 360 in the file; unwrapped 2 times"}));
}

TEST_F(UnwrapChannels, AnEpisodeBeginsAnew) {
  std::string rows = "t,q\n";
  for (int row = 0; row < 30; ++row) rows += fmt::format("{},{}\n", 0.1 * row, (8 * row) % 100);
  rows += "0.0,5\n0.1,99\n0.2,91\n";
  const std::string channel = R"(
[[channel]]
name = "q"
column = "q"
unit = "1"
wraps_at = 100
)";
  const Recording recording = load("time = \"t\"\ntime_restarts = true\n", channel, rows);
  ASSERT_EQ(recording.rows(), 33);
  EXPECT_EQ(recording.samples(29, 0), 8.0 * 29);
  EXPECT_EQ(recording.samples(30, 0), 5.0);
  EXPECT_EQ(recording.samples(31, 0), -1.0);
  EXPECT_EQ(recording.samples(32, 0), -9.0);
  EXPECT_EQ(said(recording),
            std::vector<std::string>{"q wraps at 100 in the file; unwrapped 3 times"});
}

TEST_F(UnwrapChannels, ACommandAndItsAnswerOnBothSidesOfTheSeamStayTogether) {
  std::string rows = "t,goal,q\n";
  for (int row = 0; row < 200; ++row) {
    const double q = 179.0 + 40.0 * std::sin(0.05 * row);
    rows += fmt::format("{},{},{}\n", 0.01 * row, wrapped(q + 2.0, -180.0, 360.0),
                        wrapped(q, -180.0, 360.0));
  }
  const Recording recording = load("time = \"t\"\n", R"(
[[channel]]
name = "goal"
column = "goal"
unit = "deg"
wraps_at = 360
role = "desired_position"
joint = "a"
[[channel]]
name = "q"
column = "q"
unit = "deg"
wraps_at = 360
role = "motor_position"
joint = "a"
)",
                                   rows);
  ASSERT_EQ(recording.rows(), 200);
  for (int row = 0; row < 200; ++row)
    ASSERT_NEAR(recording.samples(row, 0) - recording.samples(row, 1), 2.0 * std::numbers::pi / 180,
                1e-9);
}

TEST_F(UnwrapChannels, AWidthBelowNothingIsRefused) {
  ASSERT_TRUE(core::write_whole_file(scratch_ / "run.csv", "q\n1\n2\n").ok());
  for (const char* width : {"-360.0", "inf", "nan"}) {
    const std::string text = fmt::format(
        "[source]\n[[channel]]\nname = \"q\"\ncolumn = \"q\"\nunit = \"1\"\nwraps_at = {}\n",
        width);
    ASSERT_TRUE(core::write_whole_file(scratch_ / "run.toml", text).ok());
    LoadOptions options;
    options.profile = (scratch_ / "run.toml").string();
    const auto recording = load_recording(scratch_ / "run.csv", options);
    ASSERT_FALSE(recording.ok()) << width;
    EXPECT_NE(recording.error().message.find("run.toml:6"), std::string::npos)
        << recording.error().message;
    EXPECT_NE(recording.error().message.find("wraps_at"), std::string::npos);
  }
}

}  // namespace
}  // namespace ravencal::record
