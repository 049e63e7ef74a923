// SPDX-License-Identifier: Apache-2.0
//
// The same numbers by three routes: the model in double precision as training sees it, in single
// precision, and the loaded plugin at every instruction set; and at the plugin's input, the same
// channels as a recording has.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "core/catalogue.hpp"
#include "model/single_precision.hpp"
#include "plugin_host/robot_state.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

using model::packed::Precision;

struct Case {
  const char* name;
  std::uint32_t inputs;
  std::vector<std::uint32_t> hidden;
};

class Parity : public ::testing::TestWithParam<std::tuple<std::uint32_t, int, Precision>> {
 protected:
  static const std::vector<Case>& cases() {
    static const std::vector<Case> all = {{"paper", 208, {600, 500, 400}},
                                          {"paper, two inputs fewer", 110, {600, 500, 400}},
                                          {"light", 112, {128, 64, 32}},
                                          {"light, odd sizes", 37, {101, 33, 5}},
                                          {"one hidden layer", 16, {50}},
                                          {"linear", 112, {}},
                                          {"one input", 1, {}}};
    return all;
  }
};

TEST_P(Parity, PluginModelInSingleAndModelInDoubleAgree) {
  const auto [isa, which, precision] = GetParam();
  const Case& test = cases()[static_cast<std::size_t>(which)];
  Rig rig(isa);
  const model::CalibrationModel model = make_model(test.inputs, test.hidden, 11);
  rig.load(model, precision);
  // What runs are the weights as they were rounded; Precision.* below bounds that rounding.
  model::CalibrationModel packed = model;
  const auto bytes = model::pack_layers(model, packing_of(model, precision));
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  packed.layers = *model::unpack_layers(*bytes);
  const ravencal_info info = rig.instance.info();
  if (info.isa != isa) GTEST_SKIP() << "this processor lacks " << plugin_host::isa_name(isa);
  EXPECT_EQ(info.inputs, test.inputs);
  EXPECT_GE(info.padded_inputs, test.inputs);
  EXPECT_EQ(info.precision, static_cast<std::uint32_t>(precision));

  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.49, 0.49);
  Eigen::Vector3d worst_double = Eigen::Vector3d::Zero();
  Eigen::Vector3d worst_single = Eigen::Vector3d::Zero();
  for (int i = 0; i < 200; ++i) {
    plugin_host::CatalogueValues values{};
    Eigen::MatrixXd x(1, test.inputs);
    for (std::size_t c = 0; c < values.size(); ++c) values[c] = 3.0;
    for (std::uint32_t c = 0; c < test.inputs; ++c) {
      const auto index = *core::catalogue_index_of(model.features[c].channel);
      values[index] = model.input.mean[c] + uniform(random);
    }
    plugin_host::fill_state(values, rig.state.t_ns, true, rig.state);
    rig.api().observe_cycle_end(rig.instance.get(), &rig.state);
    rig.tick();
    // What the state can hold: floats, whole counts, whole micrometres.
    for (std::uint32_t c = 0; c < test.inputs; ++c) {
      const auto index = *core::catalogue_index_of(model.features[c].channel);
      const core::CatalogueEntry& entry = core::catalogue()[index];
      const double value = values[index];
      x(0, c) = static_cast<double>(static_cast<float>(value));
      if (entry.si_unit == "m" && entry.message_unit == "um") {
        x(0, c) = std::round(value * 1e6) * 1e-6;
      } else if (entry.si_unit == "counts" || entry.si_unit == "dac_counts" ||
                 entry.field == core::RavenField::kRunlevel ||
                 entry.field == core::RavenField::kSublevel ||
                 entry.field == core::RavenField::kLastSeq ||
                 entry.field == core::RavenField::kType) {
        x(0, c) = std::round(value);
      }
    }
    const Eigen::MatrixXd in_double = packed.predict(x);
    const Eigen::MatrixXf in_single = model::predict_single(packed, x.transpose().cast<float>());
    for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
      const auto got = static_cast<double>(rig.output.predicted_ji[j]);
      worst_double[j] = std::max(worst_double[j], std::abs(got - in_double(0, j)));
      worst_single[j] =
          std::max(worst_single[j], std::abs(got - static_cast<double>(in_single(j, 0))));
    }
  }
  // Rounding of a dot product of n terms grows like sqrt(n) units in the last place (2^-24); the
  // widest sum here has 600 terms, four layers follow each other, and the last layer's weights
  // amplify little: 4 * sqrt(600) * 2^-24 = 6e-6 of the output's scale, plus the last place of the
  // output itself (mean + scale). Twice that is allowed.
  for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
    const double size = std::abs(model.output.mean[j]) + 4.0 * model.output.scale[j];
    // int8 rounds a layer's inputs to half a step at most: 2^-15 of a limit, which is 2 here for
    // the network's inputs and 1 behind sigmoid. That is 512 times 2^-24.
    const double rounding = precision == Precision::kInt8 ? 512.0 * 6e-6 : 6e-6;
    const double tolerance =
        2.0 * (rounding * 4.0 * model.output.scale[j] + size * std::ldexp(1, -23));
    EXPECT_LT(worst_double[j], tolerance) << test.name << ", joint " << j + 1;
    EXPECT_LT(worst_single[j], tolerance) << test.name << ", joint " << j + 1;
  }
}

INSTANTIATE_TEST_SUITE_P(
    EveryInstructionSet, Parity,
    ::testing::Combine(
        ::testing::Values(RAVENCAL_ISA_BASELINE, RAVENCAL_ISA_AVX2, RAVENCAL_ISA_AVX512),
        ::testing::Range(0, 7),
        ::testing::Values(Precision::kFloat32, Precision::kBfloat16, Precision::kInt8)));

TEST(Clamping, OfThePluginIsThatOfTheModel) {
  const model::CalibrationModel model = make_model({plain("jpos.elbow"), plain("mpos.elbow")}, {8});
  for (const float moved : {-20.0F, -0.8F, 0.8F, 20.0F}) {
    Rig rig;
    rig.load(model);
    rig.state.arm[0].jpos_ji[1] += moved;
    rig.tick();
    const Eigen::RowVector2d x(static_cast<double>(rig.state.arm[0].jpos_ji[1]),
                               static_cast<double>(rig.state.arm[0].mpos_rad[1]));
    const Eigen::RowVectorXd expected = model.predict(x);
    for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
      EXPECT_NEAR(rig.output.predicted_ji[j], expected[j], 1e-5 * model.output.scale[j]) << moved;
    }
  }
}

// How far the rounding of weights moves the outputs of a random network (a trained one is measured
// by `convert`): bf16 keeps 8 bits of a weight, int8 between 7 and 8 of a row's largest.
TEST(Precision, RoundingOfWeightsMovesTheOutputsLittle) {
  const model::CalibrationModel model = make_model(112, {128, 64, 32}, 11);
  for (const Precision precision : {Precision::kBfloat16, Precision::kInt8}) {
    model::CalibrationModel packed = model;
    packed.layers = *model::unpack_layers(*model::pack_layers(model, packing_of(model, precision)));
    Eigen::MatrixXd x = Eigen::MatrixXd::Random(500, 112) * 0.49;
    x.rowwise() += model.input.mean.transpose();
    const Eigen::MatrixXd moved = packed.predict(x) - model.predict(x);
    const Eigen::RowVectorXd rms = (moved.colwise().squaredNorm() / 500.0).cwiseSqrt();
    for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
      EXPECT_LT(rms[j], 0.01 * model.output.scale[j]);
      EXPECT_GT(rms[j], 0.0);
    }
  }
}

/// Output j is the scaled channel number j of a state with these values: 0 for the value that a
/// recording in SI units says, at least 1/340 for any other.
void expect_shown(const std::array<std::size_t, RAVENCAL_JOINTS>& channels,
                  const plugin_host::CatalogueValues& si) {
  std::vector<model::FeatureSpec> features;
  for (const std::size_t channel : channels)
    features.push_back(plain(core::catalogue()[channel].name));
  model::CalibrationModel model = make_model(features, {});
  for (Eigen::Index j = 0; j < RAVENCAL_JOINTS; ++j) {
    const double value = si[channels[static_cast<std::size_t>(j)]];
    model.input.mean[j] = value;
    model.input.scale[j] = std::abs(value);
    model.input_min[j] = value - std::abs(value);
    model.input_max[j] = value + std::abs(value);
  }
  model.layers[0].weights.setIdentity();
  model.layers[0].biases.setZero();
  model.output.mean.setZero();
  model.output.scale.setOnes();
  Rig rig(RAVENCAL_ISA_BASELINE);
  rig.load(model);
  plugin_host::fill_state(si, 1'000'000, true, rig.state);
  rig.api().observe_cycle_end(rig.instance.get(), &rig.state);
  rig.tick();
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    EXPECT_NEAR(rig.output.predicted_ji[j], 0.0, 1e-6) << core::catalogue()[channels[j]].name;
  }
}

plugin_host::CatalogueValues distinct_values() {
  plugin_host::CatalogueValues message{};
  for (std::size_t i = 0; i < message.size(); ++i) message[i] = 100.0 + static_cast<double>(i);
  return plugin_host::to_si(message);
}

TEST(Gather, ShowsTheNetworkEveryChannelOfTheCatalogueAsARecordingHasIt) {
  const plugin_host::CatalogueValues si = distinct_values();
  for (std::size_t i = 1; i + 2 < core::kCatalogueSize; ++i) {
    expect_shown({i, i + 1, i + 2}, si);
    expect_shown({i + 2, i + 1, i}, si);
  }
}

TEST(Gather, ShowsTheNetworkChannelsInAnyOrder) {
  const plugin_host::CatalogueValues si = distinct_values();
  std::mt19937 random(7);
  std::uniform_int_distribution<std::size_t> any(1, core::kCatalogueSize - 1);
  for (int i = 0; i < 200; ++i) {
    const std::size_t first = any(random);
    expect_shown({first, any(random), first}, si);
  }
}

// Facts of the controller: at the hook, positions are of this cycle, but torque, DAC, desired
// values and pose are not there yet.
TEST(Gather, TakesTorqueFromTheLastPublishedStateAndPositionsFromThisOne) {
  model::CalibrationModel model = make_model({plain("jpos.elbow"), plain("tau.elbow")}, {});
  model.layers[0].weights << 1.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F;  // joint 1: jpos, joint 2: tau
  model.layers[0].biases.setZero();
  model.output.mean.setZero();
  model.output.scale = Eigen::Vector3d::Constant(0.5);  // undoes the input's scale
  Rig rig;
  rig.load(model);
  rig.tick();
  ravencal_state published = rig.state;
  published.arm[0].tau_n_m[1] += 0.25F;
  published.arm[0].jpos_ji[1] += 0.125F;  // must not be used
  rig.api().observe_cycle_end(rig.instance.get(), &published);
  ravencal_state at_hook = healthy_state(rig.state.t_ns + 1'000'000);
  at_hook.arm[0].tau_n_m[1] = 77.0F;  // must not be used
  at_hook.arm[0].jpos_ji[1] += 0.0625F;
  rig.api().step(rig.instance.get(), &at_hook, &rig.output);
  EXPECT_NEAR(rig.output.predicted_ji[0], 0.0625, 1e-6);
  EXPECT_NEAR(rig.output.predicted_ji[1], 0.25, 1e-6);
}

}  // namespace
}  // namespace ravencal::test
