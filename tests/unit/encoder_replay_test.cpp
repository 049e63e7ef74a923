// SPDX-License-Identifier: Apache-2.0
//
// Replay of recordings from which rows are missing, and of counters that jump or wrap: what was
// lost is an event with its amount, never motion.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "quadrature_reader/config.hpp"
#include "quadrature_reader/logger.hpp"
#include "record/recording_writer.hpp"
#include "unit/encoder_recorder_rig.hpp"

namespace ravencal::quadrature_reader {
namespace {

struct Replayed {
  record::Recording recording;
  std::int64_t count = 0;
  std::int64_t uncertainty_counts = 0;
  bool failed = false;

  [[nodiscard]] std::vector<record::Event> of_kind(std::string_view kind) const {
    std::vector<record::Event> found;
    for (const auto& event : recording.events)
      if (event.kind == kind) found.push_back(event);
    return found;
  }
};

std::int64_t number_in(const record::Event& event, const std::string& key) {
  const auto at = event.detail.find("\"" + key + "\":");
  EXPECT_NE(at, std::string::npos) << event.detail;
  return std::strtoll(event.detail.c_str() + at + key.size() + 3, nullptr, 10);
}

class ReplayTest : public RecorderTest {
 protected:
  static constexpr std::int64_t kTurn = 80'000;

  static Config configured(const std::string& source, const std::string& encoder) {
    auto config = parse_config("[[source]]\nname = \"s\"\n" + source +
                                   "[[encoder]]\njoint = \"shoulder\"\nsource = \"s\"\n"
                                   "counts_per_rev = 80000\nzero_counts = 0\n" +
                                   encoder,
                               "encoders.toml");
    EXPECT_TRUE(config.ok()) << config.error().message;
    return *config;
  }
  static Config can(const std::string& more = "") {
    return configured("kind = \"can\"\ninterface = \"can0\"\n", "canopen_node = 9\n" + more);
  }

  Replayed replay(Config config, const record::Recording& recording) {
    EXPECT_TRUE(record::write_recording(recording, folder_ / "in.db", true).ok());
    const fs::path out = folder_ / ("out" + std::to_string(++replays_) + ".db");
    replay_instead(config, folder_ / "in.db", 0.0);
    auto logger = Logger::create(config, out, {});
    EXPECT_TRUE(logger.ok()) << logger.error().message;
    EXPECT_TRUE((*logger)->run([] { return false; }, [](const LoggerStatus&) {}).ok());
    const Axis& axis = (*logger)->recorder().axes()[0];
    return {written(out), axis.count(), axis.uncertainty_counts(), (*logger)->failed()};
  }

  /// One channel, a value per period.
  static record::Recording sampled(const std::string& channel, std::int64_t period_ns, int rows,
                                   const std::function<double(int)>& value) {
    record::Recording recording;
    recording.channels = {{channel, "counts", record::Role::kTruthReading, "shoulder"}};
    recording.samples.resize(rows, 1);
    for (int row = 0; row < rows; ++row) {
      recording.t_ns.push_back((row + 1) * period_ns);
      recording.samples(row, 0) = value(row);
    }
    return recording;
  }
  static record::Recording counts(int rows, const std::function<double(int)>& value) {
    return sampled("shoulder.counts", 2 * core::kNsPerMs, rows, value);
  }
  /// Lines A and B of a joint that moves one count per row.
  static record::Recording lines(int rows, const std::function<std::int64_t(int)>& count) {
    constexpr double kLevels[] = {0.0, 1.0, 3.0, 2.0};
    return sampled("shoulder.lines", core::kNsPerMs, rows,
                   [&](int row) { return kLevels[((count(row) % 4) + 4) % 4]; });
  }
  static void remove_rows(record::Recording& recording,
                          const std::function<bool(Eigen::Index)>& removed) {
    Eigen::Index kept = 0;
    for (Eigen::Index row = 0; row < recording.rows(); ++row) {
      if (removed(row)) continue;
      recording.samples.row(kept) = recording.samples.row(row).eval();
      recording.t_ns[static_cast<std::size_t>(kept++)] =
          recording.t_ns[static_cast<std::size_t>(row)];
    }
    recording.samples.conservativeResize(kept, Eigen::NoChange);
    recording.t_ns.resize(static_cast<std::size_t>(kept));
  }

  int replays_ = 0;
};

/// 40 counts each 2 ms: 20 000 counts/s, turning back halfway.
double there_and_back(int row) { return 40.0 * (row < 1500 ? row : 3000 - row); }

TEST_F(ReplayTest, BothLinesAtOnceAreALossWithItsTimeAndAmountInEitherDirection) {
  for (const int sign : {1, -1}) {
    auto whole = lines(600, [&](int row) { return std::int64_t{sign} * row; });
    const auto clean = replay(can(), whole);
    EXPECT_TRUE(clean.recording.events.empty());
    EXPECT_FALSE(clean.failed);
    remove_rows(whole, [](Eigen::Index row) { return row == 333; });
    const auto result = replay(can(), whole);
    const auto lost = result.of_kind("edges_lost");
    ASSERT_EQ(lost.size(), 1U);
    EXPECT_NE(lost[0].detail.find("\"joint\":\"shoulder\""), std::string::npos);
    EXPECT_NE(lost[0].detail.find("\"fault\":\"invalid_transition\""), std::string::npos);
    EXPECT_EQ(number_in(lost[0], "amount"), 1);
    EXPECT_EQ(number_in(lost[0], "from_ns"), 333 * core::kNsPerMs);
    EXPECT_EQ(number_in(lost[0], "to_ns"), 335 * core::kNsPerMs);
    EXPECT_EQ(result.count, clean.count) << "the motion was steady";
    EXPECT_GE(result.uncertainty_counts, 4) << "nobody counted";
    EXPECT_TRUE(result.failed) << "exit code 4";
  }
}

TEST_F(ReplayTest, ABurstOfLostEdgesIsEstimatedFromThePaceAndThePositionWithheld) {
  auto cut = lines(600, [](int row) { return std::int64_t{row}; });
  remove_rows(cut, [](Eigen::Index row) { return row >= 200 && row < 245; });
  const auto result = replay(can(), cut);
  const auto lost = result.of_kind("edges_lost");
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(number_in(lost[0], "amount"), 45);
  const auto truth = *result.recording.column("shoulder.joint_truth");
  EXPECT_TRUE(std::isnan(result.recording.samples(result.recording.rows() - 1, truth)));
}

TEST_F(ReplayTest, AnEdgesRecordingSaysByItsCountsWhatIsMissing) {
  Config config = two_joints();
  (void)record(motion(), {true}, folder_ / "edges.db");
  auto edges = written(folder_ / "edges.db");
  const auto whole = replay(config, edges);
  EXPECT_TRUE(whole.recording.events.empty());
  const auto shoulder = *edges.column("shoulder.counts");
  Eigen::Index removed = 0;
  remove_rows(edges, [&](Eigen::Index row) {
    // The last rows stay, so that the end tells of all of it.
    const bool gone = row > 20 && row < edges.rows() - 20 && row % 97 < row % 5 * (row % 3);
    removed += gone ? 1 : 0;
    return gone;
  });
  ASSERT_GT(removed, 60);
  // Where the other joint's row stands in for a missing one, the edge is there, only later.
  std::int64_t missing = 0;
  for (const Eigen::Index joint : {shoulder, *edges.column("elbow.counts")}) {
    for (Eigen::Index row = 1; row < edges.rows(); ++row) {
      const double step = std::abs(edges.samples(row, joint) - edges.samples(row - 1, joint));
      if (step > 1.0) missing += std::llround(step) - 1;
    }
  }
  ASSERT_GT(missing, 20);
  ASSERT_FALSE(std::isnan(edges.samples(0, shoulder)));
  const auto result = replay(config, edges);
  EXPECT_EQ(result.count, whole.count) << "not one count off, reversals included";
  EXPECT_EQ(result.uncertainty_counts, 0);
  EXPECT_TRUE(result.failed);
  std::int64_t amount = 0;
  for (const auto& event : result.of_kind("edges_lost")) {
    EXPECT_NE(event.detail.find("\"fault\":\"missing_rows\""), std::string::npos) << event.detail;
    amount += number_in(event, "amount");
  }
  EXPECT_EQ(amount, missing);
}

TEST_F(ReplayTest, ACountThatJumpsATurnIsALossOfThatMuchAndNoMotion) {
  for (const std::int64_t jump : {kTurn, -kTurn, std::int64_t{2500}}) {
    const auto result =
        replay(can(), counts(3000, [&](int row) {
                 return there_and_back(row) + (row < 700 ? 0.0 : static_cast<double>(jump));
               }));
    const auto restart = result.of_kind("device_restarted");
    ASSERT_EQ(restart.size(), 1U) << jump;
    EXPECT_EQ(number_in(restart[0], "amount"), jump);
    EXPECT_NE(restart[0].detail.find("implausible_count"), std::string::npos);
    EXPECT_LT(std::abs(result.count), 200) << "the jump is no motion";
    EXPECT_TRUE(result.failed);
  }
}

TEST_F(ReplayTest, ACounterThatWrapsIsUnwrappedAndSaid) {
  for (const int bits : {16, 32}) {
    for (const bool is_signed : {true, false}) {
      const double range = std::ldexp(1.0, bits);
      const double start = is_signed ? 0.5 * range - 700.0 : range - 900.0;
      const auto wrapped = [&](int row) {
        const double top = is_signed ? 0.5 * range : range;
        const double value = start + there_and_back(row);
        return value >= top ? value - range : value;
      };
      const auto result = replay(can(), counts(3000, wrapped));
      const auto events = result.of_kind("counter_wrapped");
      ASSERT_EQ(events.size(), 2U) << bits << " bits, there and back";
      EXPECT_EQ(result.recording.events.size(), 2U);
      EXPECT_EQ(number_in(events[0], "amount"), std::llround(range));
      EXPECT_EQ(number_in(events[1], "amount"), -std::llround(range));
      const auto column = *result.recording.column("shoulder.counts");
      double highest = 0.0;
      for (Eigen::Index row = 0; row < result.recording.rows(); ++row)
        highest = std::fmax(highest, result.recording.samples(row, column));
      EXPECT_EQ(highest, start + 60'000.0);
      EXPECT_EQ(result.count, std::llround(start) + 40);
    }
  }
}

TEST_F(ReplayTest, TheConfiguredLimitHoldsForAReplayAndADefaultDoesNotRefuseWhatIsSteady) {
  const auto slow_limit = replay(can("max_counts_per_s = 3000\n"), counts(3000, there_and_back));
  EXPECT_FALSE(slow_limit.of_kind("edges_lost").empty()) << "20 000 counts/s";
  EXPECT_TRUE(slow_limit.failed);
  // Twice the default limit of 160 000 counts/s, at 100 Hz, smooth: the joint is that fast.
  const auto fast = sampled("shoulder.counts", 10 * core::kNsPerMs, 400,
                            [](int row) { return std::round(48'000.0 * std::sin(0.0667 * row)); });
  EXPECT_TRUE(replay(can(), fast).recording.events.empty());
  const auto own =
      configured("kind = \"replay\"\nrecording = \"in.db\"\n", "max_counts_per_s = 3000\n");
  EXPECT_TRUE(replay(own, counts(3000, there_and_back)).failed);
}

TEST_F(ReplayTest, AWholeCountsRecordingGivesNoEventAndAGapInItOnlyItsOwn) {
  EXPECT_TRUE(replay(can(), counts(3000, there_and_back)).recording.events.empty());
  const auto gap = replay(can(), counts(3000, [](int row) {
                            return row > 500 && row < 900 ? std::numeric_limits<double>::quiet_NaN()
                                                          : there_and_back(row);
                          }));
  EXPECT_EQ(gap.recording.events.size(), 1U);
  EXPECT_EQ(gap.count, 40) << "after the gap the counts are those of the recording";
}

}  // namespace
}  // namespace ravencal::quadrature_reader
