// SPDX-License-Identifier: Apache-2.0
//
// What `ravencal monitor` makes of the ticks: figures, picture, JSON, recording.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "monitor/monitor.hpp"
#include "monitor/stream.hpp"
#include "monitor/tick_recording.hpp"
#include "monitor/view.hpp"
#include "record/recording_reader.hpp"
#include "rt/rig.hpp"
#include "unit/telemetry_segment.hpp"

namespace ravencal::test {
namespace {

using monitor::NumberedTick;
using monitor::TelemetryReader;
using monitor::Watch;

std::size_t columns_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

class Monitor : public ::testing::Test {
 protected:
  Monitor() : name(telemetry_name("monitor")), segment(name) {}

  TelemetryReader reader() {
    auto opened = TelemetryReader::open(name);
    EXPECT_TRUE(opened.ok());
    return std::move(opened).value();
  }

  std::string name;
  TelemetrySegment segment;
};

ravencal_counters busy_counters() {
  ravencal_counters counters{};
  counters.ticks = 123'456'789'012;
  for (std::uint64_t& ticks : counters.ticks_in_state) ticks = 123'456'789'012;
  for (std::uint64_t& ticks : counters.ticks_in_doubt) ticks = 123'456'789'012;
  counters.transitions = 1000;
  for (ravencal_transition& change : counters.last_transitions) {
    change = {123'456'789'012, 0, RAVENCAL_STATE_FADING_OUT, RAVENCAL_STATE_CONSTANT, 0xFFF, 0};
  }
  return counters;
}

TEST(History, ShowsTheLastTenSecondsWithTheNewestAtTheRight) {
  monitor::History history;
  EXPECT_EQ(history.sparkline(true), std::string(monitor::History::kSteps, ' '));
  history.add(100, 1.0);
  history.add(101, 2.0);
  history.add(101, 9.0);
  history.add(104, 5.0);
  const std::string line = history.sparkline(true);
  ASSERT_EQ(line.size(), monitor::History::kSteps);
  EXPECT_EQ(line.substr(line.size() - 5), ".@  =");
  EXPECT_EQ(history.highest(), 9.0);
  history.add(104 + monitor::History::kSteps, 3.0);
  EXPECT_EQ(history.highest(), 3.0) << "what is older is forgotten";
  history.add(104 + monitor::History::kSteps, std::nan(""));
  EXPECT_EQ(history.highest(), 3.0);
}

TEST(Watch, CountsWhatWasMissedBetweenTicksAndAfterARestart) {
  Watch watch;
  watch.take(NumberedTick{5000, tick_number(5000)}, 1'000'000);
  EXPECT_EQ(watch.missed(), 0U) << "what came before is not missed";
  watch.take(NumberedTick{5010, tick_number(5010)}, 1'000'000);
  EXPECT_EQ(watch.missed(), 9U);
  watch.begin_writer();
  watch.take(NumberedTick{2, tick_number(2)}, 1'000'000);
  EXPECT_EQ(watch.missed(), 11U);
  EXPECT_EQ(watch.taken(), 3U);
}

TEST(Watch, KnowsHowOldTheNewestTickIsAndCallsASilentLoopStalled) {
  Watch watch;
  watch.take(NumberedTick{5, tick_number(5)}, 1'000'000);
  watch.end_poll(100.0);
  EXPECT_FALSE(watch.is_current()) << "what lay there may be old";
  watch.take(NumberedTick{6, tick_number(6)}, 1'000'000);
  watch.end_poll(100.02);
  EXPECT_TRUE(watch.is_current());
  EXPECT_EQ(watch.state(), "active");
  watch.end_poll(100.52);
  EXPECT_NEAR(watch.age_s(), 0.5, 1e-9);
  EXPECT_FALSE(watch.is_stalled());
  watch.end_poll(101.52);
  EXPECT_NEAR(watch.age_s(), 1.5, 1e-9);
  EXPECT_EQ(watch.state(), "stalled");
  watch.take(NumberedTick{7, tick_number(7)}, 1'000'000);
  watch.end_poll(101.54);
  EXPECT_EQ(watch.state(), "active");
  watch.begin_writer();
  watch.end_poll(105.0);
  EXPECT_FALSE(watch.is_current()) << "another writer: nothing is known yet";
  EXPECT_FALSE(watch.is_stalled());
}

TEST_F(Monitor, NeverCallsALoopActiveThatStoppedBeforeItLooked) {
  for (int i = 0; i < 100; ++i) segment.write();
  monitor::Options options;
  options.name = name;
  options.json = true;
  options.duration_s = 1.5;
  ::testing::internal::CaptureStdout();
  const auto outcome = monitor::run(options, [] { return true; });
  std::istringstream lines(::testing::internal::GetCapturedStdout());
  ASSERT_TRUE(outcome.ok());
  int stalled = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto json = nlohmann::json::parse(line);
    if (json.contains("event")) continue;
    EXPECT_EQ(json["state"], "stalled");
    EXPECT_EQ(json["last_state"], "active");
    EXPECT_GT(json["age_s"].get<double>(), 1.0);
    ++stalled;
  }
  EXPECT_GT(stalled, 0);
}

TEST_F(Monitor, ShowsThatTheLoopHasStalled) {
  Watch watch;
  watch.take(NumberedTick{7, tick_number(7)}, 1'000'000);
  watch.end_poll(10.0);
  watch.end_poll(13.25);
  const std::string text = joined(monitor::draw(watch, reader(), {name, "", "", true}));
  EXPECT_TRUE(contains(text, "state       stalled")) << text;
  EXPECT_TRUE(contains(text, "3.2 s old") || contains(text, "3.3 s old")) << text;
  EXPECT_FALSE(contains(text, "active")) << text;
}

TEST_F(Monitor, DrawsPictureWithinTwentyFourLinesOfEightyColumns) {
  Watch watch;
  ravencal_tick tick = tick_number(999'999);
  tick.doubts = 0xFFFFFFFFU;
  tick.predicted_ji[0] = -std::numeric_limits<float>::max();
  watch.take(NumberedTick{999'999, tick}, 1'000'000);
  watch.take(busy_counters());
  const auto lines = monitor::draw(watch, reader(), {name, "a notice", "12 rows in R.db", false});
  EXPECT_LE(lines.size(), 23U) << "the last of 24 lines stays free";
  for (const std::string& line : lines) EXPECT_LE(columns_of(line), 80U) << line;
}

TEST_F(Monitor, ShowsStateJointsAndDoubtsInWords) {
  Watch watch;
  ravencal_tick tick = tick_number(7);
  tick.jpos_ji[0] = 0.5F;
  tick.correction_ji[0] = 0.01F;
  tick.jpos_ji[2] = 0.4F;
  tick.correction_ji[2] = -0.0035F;
  tick.predicted_ji[2] = std::numeric_limits<float>::quiet_NaN();
  tick.state = RAVENCAL_STATE_FADING_OUT;
  tick.doubts = RAVENCAL_DOUBT_TIME | RAVENCAL_DOUBT_NETWORK;
  watch.take(NumberedTick{7, tick}, 1'000'000);
  const std::string text = joined(monitor::draw(watch, reader(), {name, "", "", true}));
  for (const char* part : {"process 4711", "9.8.7", "fading_out", "run level 3 (pedal down)",
                           "doubts now  time network", "28.648", "29.221 deg", "+0.573", "400.000",
                           "396.500 mm", "-3.500", "nan"}) {
    EXPECT_TRUE(contains(text, part)) << part << " in\n" << text;
  }
}

TEST_F(Monitor, ShowsTheConstantOfTheHoming) {
  Watch watch;
  ravencal_tick tick = tick_number(7);
  watch.take(NumberedTick{7, tick}, 1'000'000);
  const auto none = monitor::draw(watch, reader(), {name, "", "", true});
  EXPECT_FALSE(contains(joined(none), "homing"));
  ravencal_homing_constant constant{};
  constant.weights_checksum = 5;
  constant.constant_ji[1] = 0.01F;
  constant.constant_ji[2] = -0.0005F;
  watch.take(constant);
  const auto lines = monitor::draw(watch, reader(), {name, "", "", true});
  EXPECT_EQ(lines.size(), none.size());
  for (const std::string& line : lines) EXPECT_LE(columns_of(line), 80U) << line;
  const char* const shown =
      "homing      constant  shoulder +0.000 deg  elbow +0.573 deg  insertion -0.500 mm";
  EXPECT_TRUE(contains(joined(lines), shown)) << joined(lines);
  EXPECT_TRUE(contains(monitor::draw_line(watch, {name, "", "", true}), "elbow +0.573 deg"));
  const auto json = nlohmann::json::parse(monitor::tick_json(watch));
  EXPECT_FLOAT_EQ(json["joints"][1]["homing_constant"].get<float>(), 0.01F);
  watch.begin_writer();
  EXPECT_EQ(watch.homing_constant().weights_checksum, 0U) << "of another plugin";
}

/// In SHADOW nothing is applied, and whatever shows it says so.
TEST_F(Monitor, ShowsWhatWouldBeAppliedInShadowBesideWhatIs) {
  NumberedTick numbered{7, tick_number(7), {0.001F, 0.0F, 0.0F}};
  numbered.tick.jpos_ji[0] = 0.5F;
  numbered.tick.correction_ji[0] = 0.01F;
  numbered.tick.state = RAVENCAL_STATE_SHADOW;
  numbered.tick.would_be_state = RAVENCAL_STATE_ACTIVE;
  Watch watch;
  watch.take(numbered, 1'000'000);
  const auto lines = monitor::draw(watch, reader(), {name, "", "", true});
  const std::string text = joined(lines);
  for (const char* part : {"shadow (would be active)", "would be", "offset", "28.648   28.648 deg",
                           "+0.573", "+0.057"}) {
    EXPECT_TRUE(contains(text, part)) << part << " in\n" << text;
  }
  for (const std::string& line : lines) EXPECT_LE(columns_of(line), 80U) << line;
  const auto json = nlohmann::json::parse(monitor::tick_json(watch));
  EXPECT_EQ(json["state"], "shadow");
  EXPECT_EQ(json["would_be_state"], "active");
  EXPECT_EQ(json["joints"][0]["corrected"], 0.5);
  EXPECT_EQ(json["joints"][0]["correction"], 0.0);
  EXPECT_NEAR(json["joints"][0]["would_be"].get<double>(), 0.01, 1e-7);
  EXPECT_NEAR(json["joints"][0]["offset"].get<double>(), 0.001, 1e-8);
  EXPECT_TRUE(contains(monitor::draw_line(watch, {name, "", "", true}), "28.648+0.000 deg"));
}

TEST_F(Monitor, StreamsOneObjectPerLineInSiUnits) {
  Watch watch;
  EXPECT_EQ(monitor::tick_json(watch), "");
  ravencal_tick tick = tick_number(7);
  tick.predicted_ji[1] = std::numeric_limits<float>::infinity();
  tick.doubts = RAVENCAL_DOUBT_DISTANCE;
  watch.take(NumberedTick{7, tick}, 1'000'000);
  ravencal_counters counters{};
  counters.ticks = 8;
  counters.ticks_in_state[RAVENCAL_STATE_ACTIVE] = 8;
  watch.take(counters);
  const std::string line = monitor::tick_json(watch);
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  const auto json = nlohmann::json::parse(line);
  EXPECT_EQ(json["number"], 7);
  EXPECT_EQ(json["state"], "active");
  EXPECT_EQ(json["doubts"], nlohmann::json::array({"distance"}));
  EXPECT_EQ(json["joints"][2]["joint"], "insertion");
  EXPECT_EQ(json["joints"][2]["unit"], "m");
  EXPECT_EQ(json["joints"][2]["raw"], static_cast<double>(tick.jpos_ji[2]));
  EXPECT_TRUE(json["joints"][1]["predicted"].is_null());
  EXPECT_EQ(json["counters"]["states"]["active"], 8);
  EXPECT_EQ(json["missed_ticks"], 0);
  const auto event = nlohmann::json::parse(monitor::event_json("writer_gone", reader()));
  EXPECT_EQ(event["event"], "writer_gone");
  EXPECT_EQ(event["writer_pid"], 4711);
}

class Recorded : public Monitor {
 protected:
  Recorded() : path(scratch_folder() / (name.substr(1) + ".db")) {
    auto made = monitor::TickRecording::create(path, reader());
    EXPECT_TRUE(made.ok());
    recording.emplace(std::move(made).value());
  }
  ~Recorded() override { std::filesystem::remove(path); }
  void append(const NumberedTick& tick) { EXPECT_TRUE(recording->append(tick).ok()); }
  void append(std::uint64_t number, const ravencal_tick& tick) {
    const core::Status status = recording->append(NumberedTick{number, tick});
    EXPECT_TRUE(status.ok());
  }
  record::Recording finished() {
    EXPECT_TRUE(recording->finish().ok());
    auto read = record::read_recording(path);
    EXPECT_TRUE(read.ok()) << read.error().message;
    return std::move(read).value();
  }

  std::filesystem::path path;
  std::optional<monitor::TickRecording> recording;
};

TEST_F(Recorded, StoresWhatWouldBeAppliedBesideWhatIs) {
  NumberedTick numbered{0, tick_number(0), {0.25F, 0.0F, 0.0F}};
  append(numbered);
  numbered.number = 1;
  numbered.tick.t_ns += 1'000'000;
  numbered.tick.state = RAVENCAL_STATE_SHADOW;
  numbered.tick.would_be_state = RAVENCAL_STATE_HOLD;
  append(numbered);
  const record::Recording read = finished();
  const auto value = [&](const char* channel, Eigen::Index row) {
    return read.samples(row, read.column(channel).value());
  };
  const auto correction = static_cast<double>(numbered.tick.correction_ji[0]);
  EXPECT_EQ(value("correction.shoulder", 0), correction);
  EXPECT_EQ(value("correction.shoulder", 1), 0.0);
  EXPECT_EQ(value("would_be.shoulder", 1), correction);
  EXPECT_EQ(value("offset.shoulder", 1), 0.25);
  EXPECT_EQ(value("would_be_state", 1), RAVENCAL_STATE_HOLD);
}

TEST_F(Recorded, StoresEveryTickAndLosesNothingOfIt) {
  for (std::uint64_t i = 0; i < 300; ++i) append(i, tick_number(i));
  ravencal_tick strange = tick_number(300);
  strange.predicted_ji[1] = std::numeric_limits<float>::quiet_NaN();
  append(300, strange);
  const record::Recording read = finished();
  ASSERT_EQ(read.rows(), 301);
  EXPECT_EQ(read.meta.at("source"), name);
  const auto value = [&](const char* channel, Eigen::Index row) {
    const auto column = read.column(channel);
    EXPECT_TRUE(column) << channel;
    return read.samples(row, column.value_or(0));
  };
  for (Eigen::Index row = 0; row < 300; ++row) {
    const ravencal_tick tick = tick_number(static_cast<std::uint64_t>(row));
    EXPECT_EQ(read.t_ns[static_cast<std::size_t>(row)], tick.t_ns);
    EXPECT_EQ(value("jpos.elbow", row), static_cast<double>(tick.jpos_ji[1]));
    EXPECT_EQ(value("correction.insertion", row), static_cast<double>(tick.correction_ji[2]));
    EXPECT_EQ(value("predicted.shoulder", row), static_cast<double>(tick.predicted_ji[0]));
    EXPECT_EQ(value("enc.insertion", row), tick.enc_counts[2]);
    EXPECT_EQ(value("doubts", row), tick.doubts);
    EXPECT_NEAR(value("step", row), tick.step_ns * 1e-9, 1e-15);
    EXPECT_EQ(value("tick", row), static_cast<double>(tick.tick));
  }
  EXPECT_TRUE(std::isnan(value("predicted.elbow", 300)));
  EXPECT_EQ(value("predicted.shoulder", 300), static_cast<double>(strange.predicted_ji[0]));
  EXPECT_TRUE(read.events.empty());
}

TEST_F(Recorded, MakesAnEventOfWhatWasLostAndNoRow) {
  append(10, tick_number(10));
  append(11, tick_number(11));
  append(500, tick_number(500));
  const record::Recording read = finished();
  EXPECT_EQ(read.rows(), 3);
  ASSERT_EQ(read.events.size(), 1U);
  EXPECT_EQ(read.events[0].kind, "gap");
  EXPECT_EQ(read.events[0].t_ns, tick_number(11).t_ns);
  EXPECT_TRUE(contains(read.events[0].detail, "488 ticks lost, 12 to 499"));
}

TEST_F(Recorded, SaysWhenTheRobotsTimeRanBackAndWhenTheWriterChanged) {
  append(1000, tick_number(1000));
  append(1001, tick_number(900));
  append(1002, tick_number(901));
  append(1003, tick_number(1001));
  EXPECT_TRUE(recording->append(monitor::Change::kGone, reader()).ok());
  EXPECT_TRUE(recording->append(monitor::Change::kAttached, reader()).ok());
  append(2, tick_number(2000));
  EXPECT_EQ(recording->rows(), 3U);
  EXPECT_EQ(recording->not_stored(), 2U);
  const record::Recording read = finished();
  EXPECT_EQ(read.rows(), 3);
  std::vector<std::string> kinds;
  for (const record::Event& event : read.events) kinds.push_back(event.kind);
  EXPECT_EQ(kinds,
            (std::vector<std::string>{"time_back", "writer_gone", "writer_attached", "gap"}));
}

TEST_F(Monitor, RefusesANameThatDoesNotExist) {
  monitor::Options options;
  options.name = "/ravencal_test_nobody";
  const auto nobody = monitor::run(options, [] { return false; });
  ASSERT_FALSE(nobody.ok());
  EXPECT_EQ(nobody.error().code, core::ErrorCode::kIo);
}

}  // namespace
}  // namespace ravencal::test
