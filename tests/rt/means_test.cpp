// SPDX-License-Identifier: Apache-2.0
//
// Inputs that are exponential means, through the C ABI: time constants in seconds and lengths of
// travel whatever the rows of the training were, the arithmetic of training, and a fresh start
// where time jumps.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <iterator>

#include "model/blob_format.hpp"
#include "model/feature_matrix.hpp"
#include "model/single_precision.hpp"
#include "rt/rig.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

/// Shows up to three inputs as they are.
model::CalibrationModel window_on(const std::vector<model::FeatureSpec>& features) {
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
  return model;
}

TEST(Means, AnswerToAStepWithTheirTimeConstantWhateverTheRowPeriodWas) {
  for (const double row_period_s : {0.001, 0.01, 0.1}) {
    Rig rig;
    model::CalibrationModel model =
        window_on({mean_of("jpos.elbow", 0.2F), mean_of_abs("jpos.shoulder", 0.05F)});
    model.row_period_s = row_period_s;
    rig.load(model);
    rig.enable();
    rig.state.arm[0].jpos_ji[0] = 0.0F;
    rig.state.arm[0].jpos_ji[1] = 1.0F;
    rig.tick();
    EXPECT_EQ(rig.output.predicted_ji[1], 0.0F);
    rig.state.arm[0].jpos_ji[0] = -0.25F;
    rig.state.arm[0].jpos_ji[1] = 1.5F;
    for (int tick = 1; tick <= 600; ++tick) {
      rig.tick();
      const double t_s = 1e-3 * tick;
      ASSERT_NEAR(rig.output.predicted_ji[0], 1.5 - 0.5 * std::exp(-t_s / 0.2), 1e-6) << tick;
      ASSERT_NEAR(rig.output.predicted_ji[1], 0.25 * (1.0 - std::exp(-t_s / 0.05)), 1e-6) << tick;
    }
  }
}

/// Corrections and inputs of a model in motion, as the plugin and as training have them.
struct Compared {
  Eigen::MatrixXf live;
  Eigen::MatrixXf trained;
  model::FeatureMatrix inputs;
};

/// Shoulder and elbow swing at different speeds, stand still for a while, and swing on.
Compared compare(const std::vector<model::FeatureSpec>& features) {
  const model::CalibrationModel model = make_model(features, {16, 8});
  Rig rig;
  rig.load(model);
  rig.enable();
  record::Recording recording;
  recording.source = "live";
  recording.channels = {{"jpos.shoulder", "rad", record::Role::kFeature, ""},
                        {"jpos.elbow", "rad", record::Role::kFeature, ""}};
  constexpr int kCycles = 2000;
  recording.samples.resize(kCycles, 2);
  Compared compared;
  compared.live.resize(RAVENCAL_JOINTS, kCycles);
  float* const jpos_ji = rig.state.arm[0].jpos_ji;
  const float shoulder = jpos_ji[0];
  const float elbow = jpos_ji[1];
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    const auto t = static_cast<float>(cycle < 800 ? cycle : std::max(cycle - 400, 800));
    jpos_ji[0] = shoulder + 0.2F * std::sin(0.007F * t);
    jpos_ji[1] = elbow + 0.2F * std::sin(0.003F * t);
    rig.tick();
    recording.t_ns.push_back(rig.state.t_ns);
    recording.samples(cycle, 0) = static_cast<double>(jpos_ji[0]);
    recording.samples(cycle, 1) = static_cast<double>(jpos_ji[1]);
    compared.live.col(cycle) = Eigen::Map<const Eigen::Vector3f>(rig.output.predicted_ji);
  }
  const auto inputs = model::feature_matrix(features, recording, model.row_period_s);
  EXPECT_TRUE(inputs.ok()) << inputs.error().message;
  compared.inputs = *inputs;
  compared.trained = model::predict_single(model, inputs->transpose());
  return compared;
}

TEST(Means, GiveTheCorrectionsOfTrainingsArithmetic) {
  const Compared motion =
      compare({plain("jpos.elbow"), mean_of("jpos.elbow", 0.1F), mean_of_abs("jpos.elbow", 5.0F),
               with_play("jpos.elbow", 0.01F), lagged("jpos.elbow", 1)});
  EXPECT_LT((motion.live - motion.trained).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_GT((motion.live.colwise() - motion.live.col(0)).cwiseAbs().maxCoeff(), 1e-4F)
      << "the inputs moved";
}

TEST(Means, OverTravelGiveTheCorrectionsOfTrainingsArithmetic) {
  const Compared motion =
      compare({travel_mean_of("jpos.shoulder", 0.05F, "jpos.elbow"), mean_of("jpos.shoulder", 0.1F),
               travel_mean_of_abs("jpos.elbow", 0.3F, "jpos.shoulder"), plain("jpos.elbow"),
               travel_mean_of("jpos.elbow", 0.02F, "jpos.elbow"), plain("jpos.shoulder")});
  EXPECT_LT((motion.live - motion.trained).cwiseAbs().maxCoeff(), 1e-6F);
  for (const Eigen::Index i : {0, 2, 4}) {
    const auto input = motion.inputs.col(i);
    EXPECT_GT(input.maxCoeff() - input.minCoeff(), 0.02F) << "input " << i << " moved";
    EXPECT_EQ(input[1100], input[1199]) << "input " << i << " stands with the arm";
  }
}

TEST(Means, OverTravelFollowTheirPositionWhateverTheRowPeriodWas) {
  for (const double row_period_s : {0.001, 0.1}) {
    Rig rig;
    model::CalibrationModel model =
        window_on({travel_mean_of("jpos.elbow", 0.5F, "jpos.shoulder"),
                   travel_mean_of_abs("jpos.elbow", 0.25F, "jpos.shoulder"), plain("jpos.shoulder"),
                   plain("jpos.elbow")});
    model.row_period_s = row_period_s;
    rig.load(model);
    rig.enable();
    float* const jpos_ji = rig.state.arm[0].jpos_ji;
    jpos_ji[0] = 0.0F;
    jpos_ji[1] = 1.0F;
    rig.tick();
    jpos_ji[1] = -3.0F;
    for (int tick = 0; tick < 50; ++tick) rig.tick();
    EXPECT_EQ(rig.output.predicted_ji[0], 1.0F) << "no travel, no change";
    EXPECT_EQ(rig.output.predicted_ji[1], 1.0F);
    constexpr double kStep = 1.0 / 1024.0;
    for (int tick = 1; tick <= 1024; ++tick) {
      jpos_ji[0] = static_cast<float>(kStep * tick);
      rig.tick();
      const auto answer = [&](double travel) {
        const double slack = travel * static_cast<double>(model::kTravelDeadband);
        return std::exp(-std::max(0.0, kStep * tick - slack) / travel);
      };
      ASSERT_NEAR(rig.output.predicted_ji[0], -3.0 + 4.0 * answer(0.5), 4.0 * kStep / 0.5) << tick;
      ASSERT_NEAR(rig.output.predicted_ji[1], 3.0 - 2.0 * answer(0.25), 2.0 * kStep / 0.25) << tick;
    }
  }
}

TEST(Means, StartAfreshWhenTimeJumpsAndIgnoreWhatIsNoNumber) {
  Rig rig;
  rig.load(window_on({mean_of("jpos.elbow", 1.0F)}));
  rig.enable();
  rig.state.arm[0].jpos_ji[1] = 1.0F;
  for (int i = 0; i < 10; ++i) rig.tick();
  rig.state.arm[0].jpos_ji[1] = std::nanf("");
  rig.tick();
  rig.state.arm[0].jpos_ji[1] = 1.001F;
  rig.tick();
  EXPECT_NEAR(rig.output.predicted_ji[0], 1.000001F, 2e-7F);
  rig.state.t_ns += 1'000'000'000;
  rig.tick();
  EXPECT_EQ(rig.output.predicted_ji[0], 1.001F);
}

TEST(Means, WithATimeConstantBeyondItsRangeAreRefused) {
  const auto path = write_weights(window_on({mean_of("jpos.elbow", 1.0F)}), "mean");
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  const std::vector<std::byte> good(first, first + text.size());
  namespace blob = model::blob;
  const std::size_t at =
      blob::section_entry(good.data(), blob::kFeatures).offset + blob::kFeatureParameterAt;
  Rig rig;
  for (const float time_constant_s : {1.0F, 0.0F, 2000.0F, std::nanf("")}) {
    std::vector<std::byte> bytes = good;
    const auto bits = std::bit_cast<std::uint32_t>(time_constant_s);
    for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(bits >> (8 * i));
    repair_checksum(bytes);
    const auto changed = scratch_folder() / "changed_mean.blob";
    std::ofstream(changed, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    const core::Status loaded = rig.instance.load(changed);
    EXPECT_EQ(loaded.ok(), time_constant_s == 1.0F) << time_constant_s;
    if (!loaded.ok()) {
      EXPECT_NE(loaded.error().message.find("invalid channel, transform or parameter"),
                std::string::npos)
          << loaded.error().message;
    }
  }
}

}  // namespace
}  // namespace ravencal::test
