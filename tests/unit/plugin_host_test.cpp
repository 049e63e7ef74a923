// SPDX-License-Identifier: Apache-2.0
//
// The stand-in for the robot's loop: what it hands over, in which order, and what it reports.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/catalogue.hpp"
#include "host/loop.hpp"
#include "host/robot_source.hpp"
#include "host/summary.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

/// Gives healthy states and notes the order of calls.
class ScriptedSource final : public host::RobotSource {
 public:
  explicit ScriptedSource(std::int64_t cycles) : cycles_(cycles) {}
  [[nodiscard]] std::int64_t cycles() const override { return cycles_; }
  void rest(ravencal_state& state) override { state = healthy_state(t_ns_ + 1'000'000); }
  void begin(ravencal_state& state) override {
    EXPECT_TRUE(ended_);
    ended_ = false;
    t_ns_ += 1'000'000;
    state = healthy_state(t_ns_);
  }
  void end(ravencal_state& state) override {
    EXPECT_FALSE(ended_);
    ended_ = true;
    EXPECT_EQ(state.t_ns, t_ns_);
  }
  [[nodiscard]] host::Joints truth_ji() const override { return {1.0, 2.0, 3.0}; }

 private:
  std::int64_t cycles_;
  std::int64_t t_ns_ = 0;
  bool ended_ = true;
};

const auto kGoOn = [](double) { return true; };

TEST(HostLoop, RunsEveryCycleOnceAndReportsWhatItSaw) {
  Rig rig;
  const model::CalibrationModel model = make_model(16, {});
  rig.load(model);
  rig.enable();
  ScriptedSource source(3000);
  host::LoopOptions options;
  options.rate_hz = 0.0;
  options.ticks = 1'000'000;
  const host::LoopResult result = host::run_loop(options, rig.instance, source, kGoOn);
  ASSERT_EQ(result.ticks.size(), 3000U);
  EXPECT_FALSE(result.real_time);
  EXPECT_FALSE(result.hindrance.empty());
  const host::Summary summary = host::summarise(result, options, rig.instance, model);
  EXPECT_EQ(summary.counters.ticks, 4000U) << "with a second of pedal up before";
  EXPECT_EQ(summary.corrected_ticks, 3000U);
  EXPECT_EQ(summary.counters.ticks_in_doubt[3], 0U) << "every cycle's end was handed over";

  const auto json = nlohmann::json::parse(host::summary_json(summary));
  EXPECT_EQ(json["ticks"], 3000);
  EXPECT_EQ(json["rate_hz"], 0.0);
  EXPECT_EQ(json["realtime"], false);
  EXPECT_EQ(json["states"]["active"], summary.counters.ticks_in_state[RAVENCAL_STATE_ACTIVE]);
  ASSERT_EQ(json["joints"].size(), 3U);
  EXPECT_EQ(json["joints"][0]["joint"], "shoulder");
  EXPECT_EQ(json["joints"][0]["unit"], "deg");
  EXPECT_EQ(json["joints"][0]["samples"], summary.corrected_ticks);
  const double per_rad = 180.0 / 3.14159265358979;
  const ravencal_state state = healthy_state();
  const double raw = 1.0 - static_cast<double>(state.arm[0].jpos_ji[0]);
  EXPECT_NEAR(json["joints"][0]["raw"]["rmse"], raw * per_rad, 1e-4);
  EXPECT_NEAR(json["joints"][0]["bias_removed"]["peak"], (raw - model.output.mean[0]) * per_rad,
              1e-4);
  const host::Tick& last = result.ticks.back();
  EXPECT_NEAR(json["joints"][0]["calibrated"]["rmse"],
              (1.0 - static_cast<double>(last.corrected_ji[0])) * per_rad, 1e-4);
  for (const char* times : {"step_ns", "wakeup_ns"}) {
    EXPECT_LE(json[times]["p50"], json[times]["p99"]);
    EXPECT_LE(json[times]["p99"], json[times]["p999"]);
    EXPECT_LE(json[times]["p999"], json[times]["max"]);
  }
}

TEST(HostLoop, StopsWhenTheUserAsks) {
  Rig rig;
  ScriptedSource source(1'000'000'000);
  host::LoopOptions options;
  options.rate_hz = 1000.0;
  options.ticks = 60'000;
  int looks = 0;
  const host::LoopResult result =
      host::run_loop(options, rig.instance, source, [&](double) { return ++looks < 2; });
  EXPECT_GT(result.ticks.size(), 0U);
  EXPECT_LT(result.ticks.size(), 60'000U);
}

record::Recording recording_of(std::vector<std::string> names, std::vector<std::int64_t> t_ns,
                               const Eigen::MatrixXd& samples) {
  record::Recording recording;
  for (const std::string& name : names)
    recording.channels.push_back({name, "rad", record::Role::kFeature, ""});
  recording.t_ns = std::move(t_ns);
  recording.samples = samples;
  recording.source = "made.db";
  return recording;
}

TEST(RecordingSource, HoldsEachRowUntilTheNext) {
  const auto recording = recording_of({"jpos.elbow", "tau.elbow"}, {0, 10'000'000, 20'000'000},
                                      (Eigen::MatrixXd(3, 2) << 1, 10, 2, 20, 3, 30).finished());
  const auto source = host::make_recording_source(recording, {});
  ASSERT_TRUE(source.ok()) << source.error().message;
  EXPECT_EQ((*source)->cycles(), 21);
  for (std::int64_t i = 0; i < 21; ++i) {
    ravencal_state state{};
    (*source)->begin(state);
    EXPECT_EQ(state.t_ns, i * 1'000'000);
    EXPECT_EQ(state.arm[0].jpos_ji[1], static_cast<float>(1 + i / 10));
    EXPECT_EQ(state.runlevel, 3) << "a recording without run level is taken as pedal down";
    (*source)->end(state);
    EXPECT_EQ(state.arm[0].tau_n_m[1], static_cast<float>(10 * (1 + i / 10)));
    EXPECT_TRUE(std::isnan((*source)->truth_ji()[1]));
  }
}

TEST(RecordingSource, SkipsWhatIsBeyondASecondOfAGap) {
  constexpr std::int64_t kMs = 1'000'000, kYears_ns = 10LL * 365 * 86'400 * 1'000'000'000;
  const auto recording =
      recording_of({"jpos.elbow"}, {0, 10 * kMs, kYears_ns, kYears_ns + 10 * kMs},
                   (Eigen::MatrixXd(4, 1) << 1, 2, 3, 4).finished());
  const auto source = host::make_recording_source(recording, {});
  ASSERT_TRUE(source.ok()) << source.error().message;
  ASSERT_EQ((*source)->cycles(), 10 + 1001 + 11);
  EXPECT_EQ((*source)->skipped_ns(), kYears_ns - 1011 * kMs);
  std::int64_t last_ns = -kMs;
  for (std::int64_t i = 0; i < (*source)->cycles(); ++i) {
    ravencal_state state{};
    (*source)->begin(state);
    EXPECT_TRUE(state.t_ns == last_ns + kMs || state.t_ns == kYears_ns) << state.t_ns;
    last_ns = state.t_ns;
    (*source)->end(state);
  }
  EXPECT_EQ(last_ns, kYears_ns + 10 * kMs);
}

TEST(RecordingSource, NamesTheChannelThatTheWeightsNeed) {
  const auto recording = recording_of({"jpos.elbow"}, {0}, Eigen::MatrixXd::Zero(1, 1));
  const std::vector<model::FeatureSpec> features = {plain("jpos.elbow"), plain("dac.roll")};
  const auto source = host::make_recording_source(recording, features);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().message.find("'dac.roll'"), std::string::npos);
  EXPECT_EQ(source.error().code, core::ErrorCode::kData);
}

TEST(PluginLibrary, SaysWhatIsWrongWithAFileThatIsNoPlugin) {
  const auto missing = plugin_host::Library::open("/nonexistent/plugin.so");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, core::ErrorCode::kIo);
  const auto weights = write_weights(make_model(1, {}), "not_a_library");
  const auto other = plugin_host::Library::open(weights);
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("not_a_library"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::test
