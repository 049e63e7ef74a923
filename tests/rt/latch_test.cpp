// SPDX-License-Identifier: Apache-2.0
//
// The inputs that the plugin sees live are those that training made of a recording of the same run:
// every channel of the catalogue, every bit, with the cycle of lag that the hook has.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "core/catalogue.hpp"
#include "host/robot_source.hpp"
#include "learn/train.hpp"
#include "model/hook_view.hpp"
#include "physics/plant.hpp"
#include "record/load.hpp"
#include "rt/rig.hpp"
#include "simulation/session.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::test {
namespace {

template <typename T>
T checked(core::Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.error().message);
  return std::move(result).value();
}

physics::Plant plant() {
  return checked(physics::load_plant(RAVENCAL_SOURCE_DIR "/tools/plants/raven2.toml"));
}

trajectory::Trajectory motion() {
  trajectory::RandomOptions options;
  options.seed = 3;
  options.duration_s = 1.5;
  return checked(trajectory::make_random(options));
}

/// One run of the twin, every cycle recorded as it is published.
record::Recording record_run(double rate_hz) {
  const auto path = scratch_folder() / "latch.db";
  simulation::SessionOptions options;
  options.rate_hz = rate_hz;
  options.overwrite = true;
  const auto summary =
      simulation::record_session(plant(), motion(), path, options, [](double) { return true; });
  if (!summary.ok()) throw std::runtime_error(summary.error().message);
  return checked(record::load_recording(path.string(), {}));
}

std::vector<model::FeatureSpec> every_feature() {
  std::vector<model::FeatureSpec> features;
  for (const core::CatalogueEntry& entry : core::catalogue()) features.push_back(plain(entry.name));
  features.push_back(lagged("jpos.elbow", 7));
  features.push_back(lagged("tau.elbow", 3));
  features.push_back(lagged("dac.shoulder", 20));
  features.push_back(with_play("jpos.shoulder", 0.001F));
  features.push_back(with_play("mpos_d.elbow", 0.05F));
  features.push_back(with_play("tau.insertion", 0.01F));
  features.push_back(mean_of("jpos.elbow", 0.02F));
  features.push_back(mean_of("tau.elbow", 0.01F));
  features.push_back(mean_of_abs("mvel.shoulder", 0.02F));
  features.push_back(mean_of_abs("dac.insertion", 0.01F));
  // Channel and position of the current and the latched state, in all four combinations.
  features.push_back(travel_mean_of("jpos.elbow", 0.02F, "mpos.shoulder"));
  features.push_back(travel_mean_of("tau.elbow", 0.001F, "jpos.elbow"));
  features.push_back(travel_mean_of_abs("mvel.shoulder", 0.02F, "mpos_d.shoulder"));
  features.push_back(travel_mean_of_abs("dac.insertion", 0.02F, "mpos_d.shoulder"));
  return features;
}

/// Shows three inputs as they are: what the C ABI tells of a network's inputs. The positions of
/// means over travel follow as inputs that are not shown.
model::CalibrationModel make_window(std::span<const model::FeatureSpec> shown) {
  std::vector<model::FeatureSpec> features{shown.begin(), shown.end()};
  for (const model::FeatureSpec& feature : shown) {
    if (!feature.along.empty()) features.push_back(plain(feature.along));
  }
  const auto n = static_cast<Eigen::Index>(features.size());
  model::CalibrationModel model = make_model(features, {});
  model.input.mean.setZero();
  model.input.scale.setOnes();
  model.input_min.setConstant(-1e6);
  model.input_max.setConstant(1e6);
  model.layers[0].weights = Eigen::MatrixXf::Identity(RAVENCAL_JOINTS, n);
  model.layers[0].biases.setZero();
  model.output.mean.setZero();
  model.output.scale.setOnes();
  model.row_period_s = model::kControlCycleS;
  return model;
}

/// What the plugin sees while the twin runs: [cycles x features].
model::FeatureMatrix see_live(const std::vector<model::FeatureSpec>& features) {
  Rig rig;
  std::vector<plugin_host::Instance> windows;
  for (std::size_t first = 0; first < features.size(); first += RAVENCAL_JOINTS) {
    const std::size_t count = std::min<std::size_t>(RAVENCAL_JOINTS, features.size() - first);
    windows.push_back(checked(plugin_host::Instance::create(rig.library, rig.config)));
    const auto path = write_weights(make_window(std::span(features).subspan(first, count)),
                                    "window" + std::to_string(first));
    const core::Status loaded = windows.back().load(path);
    if (!loaded.ok()) throw std::runtime_error(loaded.error().message);
    rig.api().enable(windows.back().get(), 1);
  }
  const auto source = checked(host::make_twin_source(plant(), motion(), {}));
  model::FeatureMatrix seen(source->cycles(), static_cast<Eigen::Index>(features.size()));
  for (Eigen::Index cycle = 0; cycle < seen.rows(); ++cycle) {
    ravencal_state state{};
    source->begin(state);
    ravencal_state published = state;
    source->end(published);
    for (std::size_t w = 0; w < windows.size(); ++w) {
      rig.api().step(windows[w].get(), &state, &rig.output);
      rig.api().observe_cycle_end(windows[w].get(), &published);
      const std::size_t first = w * RAVENCAL_JOINTS;
      for (std::size_t j = 0; j < RAVENCAL_JOINTS && first + j < features.size(); ++j) {
        seen(cycle, static_cast<Eigen::Index>(first + j)) = rig.output.predicted_ji[j];
      }
    }
  }
  return seen;
}

/// How many values of a feature differ in any bit, from its first valid row on.
int count_differences(const model::FeatureMatrix& a, const model::FeatureMatrix& b,
                      Eigen::Index column, Eigen::Index first) {
  int differences = 0;
  for (Eigen::Index row = first; row < a.rows(); ++row) {
    const auto bits = std::bit_cast<std::uint32_t>(a(row, column));
    differences += bits == std::bit_cast<std::uint32_t>(b(row, column)) ? 0 : 1;
  }
  return differences;
}

TEST(Latch, LiveInputsAreThoseOfTrainingToTheLastBit) {
  const auto features = every_feature();
  const record::Recording recording = record_run(1000.0);
  const model::FeatureMatrix live = see_live(features);
  ASSERT_EQ(live.rows(), recording.rows());
  const auto published = model::feature_matrix(features, recording, model::kControlCycleS);
  const auto at_hook =
      model::feature_matrix(features, model::as_seen_at_hook(recording), model::kControlCycleS);
  ASSERT_TRUE(published.ok() && at_hook.ok());
  int changed = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    // The plugin's play operators and means know one cycle more than the recording: the one before
    // its first. It takes a mean 35 time constants or lengths to forget that to the last bit of its
    // state.
    const bool play = features[i].transform == model::Transform::kPlay;
    const bool mean =
        model::is_mean(features[i].transform) || model::is_travel_mean(features[i].transform);
    const Eigen::Index first = mean ? 1000 : play ? 10 : 1 + features[i].lag_rows;
    EXPECT_EQ(count_differences(live, *at_hook, column, first), 0) << features[i].text();
    // Without the shift, what moves and is latched does differ.
    changed += count_differences(live, *published, column, first) > 0 ? 1 : 0;
  }
  EXPECT_GT(changed, 20);
}

TEST(Latch, TrainingTakesTheShiftWhereTheRecordingHasEveryCycle) {
  learn::TrainOptions options;
  options.features = "tau.elbow,jpos.elbow";
  options.hidden = {};
  const auto trained_on = [&](const record::Recording& recording, learn::Latched latched) {
    options.latched = latched;
    const record::Recording* const pointer = &recording;
    return checked(learn::train_model({&pointer, 1}, {}, options, [](const auto&) { return true; }))
        .model;
  };
  const record::Recording fast = record_run(1000.0);
  EXPECT_TRUE(model::is_trained_at_hook(trained_on(fast, learn::Latched::kAuto)));
  EXPECT_FALSE(model::is_trained_at_hook(trained_on(fast, learn::Latched::kOff)));
  const auto shifted = model::inputs_of(trained_on(fast, learn::Latched::kAuto), fast);
  const auto plain = model::inputs_of(trained_on(fast, learn::Latched::kOff), fast);
  ASSERT_TRUE(shifted.ok() && plain.ok());
  EXPECT_EQ((*shifted)(500, 0), (*plain)(499, 0));
  EXPECT_EQ((*shifted)(500, 1), (*plain)(500, 1));

  const record::Recording slow = record_run(100.0);
  EXPECT_FALSE(model::is_trained_at_hook(trained_on(slow, learn::Latched::kAuto)));
  const auto between = model::inputs_of(trained_on(slow, learn::Latched::kOn), slow);
  const auto rows = model::inputs_of(trained_on(slow, learn::Latched::kOff), slow);
  ASSERT_TRUE(between.ok() && rows.ok());
  EXPECT_NEAR((*between)(50, 0), 0.9F * (*rows)(50, 0) + 0.1F * (*rows)(49, 0), 1e-6);
  EXPECT_TRUE(std::isnan((*between)(0, 0)));
}

}  // namespace
}  // namespace ravencal::test
