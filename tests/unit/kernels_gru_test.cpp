// SPDX-License-Identifier: Apache-2.0
//
// The GRU of every instruction set and precision, advanced tick by tick, against the same window
// computed afresh in double precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>

#include "unit/kernels_gru.hpp"

namespace ravencal::kernels_test {
namespace {

constexpr std::uint32_t kTicksPerRow = 2;
constexpr GruShape kSmall = {37, 21, 5, 3, 19};     // no width is a multiple of a vector
constexpr GruShape kOddLines = {37, 40, 5, 3, 19};  // the last panel is one line wide

std::vector<kernels::Isa> supported_isas() {
  std::vector<kernels::Isa> found;
  for (std::uint8_t i = 0; i < kernels::kIsaCount; ++i) {
    const auto isa = static_cast<kernels::Isa>(i);
    if (kernels::is_supported(isa)) found.push_back(isa);
  }
  return found;
}

/// Random walks within [-1, 1]: inputs as a robot has them.
class Inputs {
 public:
  Inputs(std::size_t count, std::uint32_t seed) : values_(count), random_(seed) {}
  const std::vector<float>& next() {
    std::normal_distribution<float> normal(0.0F, 0.2F);
    for (float& value : values_) value = std::clamp(value + normal(random_), -1.0F, 1.0F);
    return values_;
  }

 private:
  std::vector<float> values_;
  std::mt19937 random_;
};

/// The largest difference from the reference over three windows' worth of ticks, from the first
/// whole window on.
double worst_error(const GruNetwork& network, Precision precision, kernels::Isa isa) {
  PackedGru packed(network, precision, kTicksPerRow);
  EXPECT_TRUE(packed.ok());
  const std::size_t stride = network.shape.stride_rows * kTicksPerRow;
  const std::size_t span = (network.shape.window - std::size_t{1}) * stride;
  Inputs inputs(network.shape.inputs, 3);
  std::deque<std::vector<float>> past;
  double worst = 0.0;
  for (std::size_t tick = 0; tick < 3 * span; ++tick) {
    past.push_back(inputs.next());
    const std::vector<float> outputs = packed.run(isa, past.back());
    if (past.size() <= span) continue;
    std::vector<std::vector<float>> window;
    for (std::size_t k = 0; k < network.shape.window; ++k) window.push_back(past[k * stride]);
    const std::vector<double> expected = reference_gru(network, window);
    for (std::size_t j = 0; j < expected.size(); ++j) {
      worst = std::max(worst, std::abs(static_cast<double>(outputs[j]) - expected[j]));
    }
    past.pop_front();
  }
  return worst;
}

// f32: some hundred roundings of 6e-8 of sums of a few units. bf16 and int8: weights rounded by
// 2^-9 of themselves and 2^-8 of the row's largest, at random: a unit's sum of norm 2 moves by
// 4e-3, 8e-3, and five steps and two layers pass that on.
TEST(Gru, AgreesWithTheWindowInDoubleInEveryPrecisionAndInstructionSet) {
  const std::pair<Precision, double> tolerances[] = {
      {Precision::kFloat32, 1e-5}, {Precision::kBfloat16, 0.04}, {Precision::kInt8, 0.08}};
  for (const GruShape& shape : {kSmall, kOddLines}) {
    const GruNetwork network = random_gru(shape, 1);
    for (const auto& [precision, tolerance] : tolerances) {
      for (const kernels::Isa isa : supported_isas()) {
        const double error = worst_error(network, precision, isa);
        EXPECT_LT(error, tolerance) << kernels::name_of(isa) << ' ' << shape.units;
        EXPECT_GT(error, 0.0) << "compared with itself?";
      }
    }
  }
}

TEST(Gru, EveryWindowUpToTheLongestIsRight) {
  for (std::uint8_t window = 2; window <= kernels::kMaxWindow; ++window) {
    GruShape shape = kSmall;
    shape.window = window;
    const GruNetwork network = random_gru(shape, window);
    EXPECT_LT(worst_error(network, Precision::kFloat32, kernels::best_isa()), 1e-5) << int{window};
  }
}

TEST(Gru, ForgetsANanWithTheWindow) {
  const GruNetwork network = random_gru(kSmall, 2);
  PackedGru clean(network, Precision::kFloat32, 1);
  PackedGru hit(network, Precision::kFloat32, 1);
  Inputs inputs(kSmall.inputs, 4);
  const std::size_t span = (kSmall.window - std::size_t{1}) * kSmall.stride_rows;
  for (std::size_t tick = 0; tick < 3 * span; ++tick) {
    std::vector<float> sample = inputs.next();
    const std::vector<float> expected = clean.run(kernels::best_isa(), sample);
    if (tick == span) sample[5] = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> outputs = hit.run(kernels::best_isa(), sample);
    for (std::size_t j = 0; j < outputs.size(); ++j) {
      EXPECT_EQ(std::isnan(outputs[j]), tick == span) << tick;
      if (tick > 2 * span) {
        EXPECT_EQ(outputs[j], expected[j]) << tick;
      }
    }
  }
}

TEST(Gru, GivesTheSameBitsAgain) {
  const GruNetwork network = random_gru(kSmall, 3);
  for (const kernels::Isa isa : supported_isas()) {
    PackedGru one(network, Precision::kInt8, 1);
    PackedGru two(network, Precision::kInt8, 1);
    Inputs inputs(kSmall.inputs, 5);
    for (int tick = 0; tick < 40; ++tick) {
      const std::vector<float>& sample = inputs.next();
      EXPECT_EQ(one.run(isa, sample), two.run(isa, sample));
    }
  }
}

TEST(Gru, ALayoutThatIsNoGruIsRefused) {
  const GruNetwork network = random_gru(kSmall, 4);
  const auto bytes_of = [&](auto change) {
    auto layers = gru_sources(network);
    change(layers);
    return kernels::packed_bytes(layers, Precision::kFloat32);
  };
  using Layers = std::vector<kernels::LayerSource>;
  EXPECT_GT(bytes_of([](Layers&) {}), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers[1].window = 1; }), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers[1].window = kernels::kMaxWindow + 1; }), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers[1].stride_rows = 0; }), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers[0].stride_rows = 1; }), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers[1].kind = kernels::LayerKind::kDense; }), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers[0].kind = kernels::LayerKind::kDense; }), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers.resize(2); }), 0U);
  EXPECT_EQ(bytes_of([](Layers& layers) { layers.resize(1); }), 0U);
}

}  // namespace
}  // namespace ravencal::kernels_test
