// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "model/kernel_promise.hpp"
#include "unit/kernels_network.hpp"

namespace ravencal::kernels_test {
namespace {

using kernels::Isa;

std::vector<Isa> isas() {
  std::vector<Isa> found;
  for (std::uint8_t i = 0; i < kernels::kIsaCount; ++i) {
    if (kernels::is_supported(static_cast<Isa>(i))) found.push_back(static_cast<Isa>(i));
  }
  return found;
}

std::vector<float> random_inputs(std::size_t count, std::mt19937& random) {
  std::normal_distribution<float> normal;
  std::vector<float> inputs(count);
  for (float& input : inputs) input = std::clamp(normal(random), -6.0F, 6.0F);
  return inputs;
}

/// One layer that passes a value through an activation: 16 outputs of weight 1, so that it takes
/// the panel path.
Network activation_only(Activation activation) {
  return {{1, 16, activation, std::vector<float>(16, 1.0F), std::vector<float>(16, 0.0F)}};
}

/// The weights as bfloat16 or int8 hold them, so that the arithmetic can be tested apart from the
/// rounding of weights.
Network rounded_to_bfloat16(Network network) {
  for (Layer& layer : network) {
    if (layer.outputs <= kernels::kFewOutputs) continue;
    for (float& weight : layer.weights) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &weight, sizeof(bits));
      bits = (bits + 0x7FFFU + ((bits >> 16U) & 1U)) & 0xFFFF0000U;
      std::memcpy(&weight, &bits, sizeof(bits));
    }
  }
  return network;
}

Network rounded_to_int8(Network network) {
  for (Layer& layer : network) {
    if (layer.outputs <= kernels::kFewOutputs) continue;
    for (std::size_t o = 0; o < layer.outputs; ++o) {
      float* const row = layer.weights.data() + o * layer.inputs;
      float largest = 0.0F;
      for (std::size_t i = 0; i < layer.inputs; ++i) largest = std::max(largest, std::abs(row[i]));
      const float scale = largest / 127.0F;
      for (std::size_t i = 0; i < layer.inputs; ++i) row[i] = std::rint(row[i] / scale) * scale;
    }
  }
  return network;
}

struct Case {
  Network network;
  std::vector<float> inputs;
};

/// Random shapes: every remainder of panels, lines, pairs and groups of four occurs.
Case random_case() {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  const auto layers = *rc::gen::inRange<std::size_t>(1, 5);
  std::vector<std::uint32_t> sizes;
  std::vector<Activation> activations;
  for (std::size_t l = 0; l <= layers; ++l)
    sizes.push_back(*rc::gen::inRange<std::uint32_t>(1, 180));
  for (std::size_t l = 0; l < layers; ++l) {
    activations.push_back(*rc::gen::element(Activation::kLinear, Activation::kSigmoid,
                                            Activation::kTanh, Activation::kRelu));
  }
  Case result{random_network(sizes, activations, random), {}};
  result.inputs = random_inputs(sizes.front(), random);
  return result;
}

/// Largest value in the network: what int8 must be able to represent.
float largest_value(const Network& network, const std::vector<float>& inputs) {
  double largest = 6.0;
  for (std::size_t l = 1; l <= network.size(); ++l) {
    const Network front(network.begin(), network.begin() + static_cast<std::ptrdiff_t>(l));
    for (const double y : reference_forward(front, inputs))
      largest = std::max(largest, std::abs(y));
  }
  return static_cast<float>(largest);
}

/// `tolerance` is relative to the largest value in the network.
void expect_near_reference(const Case& c, const Network& exact, Precision precision,
                           double tolerance) {
  const float limit = 1.01F * largest_value(exact, c.inputs);
  const Packed packed(c.network, precision, limit);
  RC_ASSERT(packed.ok());
  const auto expected = reference_forward(exact, c.inputs);
  for (const Isa isa : isas()) {
    const auto actual = packed.run(isa, c.inputs);
    for (std::size_t j = 0; j < expected.size(); ++j) {
      RC_ASSERT(std::abs(static_cast<double>(actual[j]) - expected[j]) <=
                tolerance * static_cast<double>(limit));
    }
  }
}

// A sum of n products of a few units carries n roundings of 2^-24 at most; four layers pass each
// other's errors on with a gain of about 2 each (weights of norm 2): 180 * 6e-8 * 2^4 = 1.7e-4 at
// worst, a tenth of it in practice.
RC_GTEST_PROP(Kernels, EveryInstructionSetAgreesWithDoubleInFloat32, ()) {
  const Case c = random_case();
  expect_near_reference(c, c.network, Precision::kFloat32, 2e-5);
}

RC_GTEST_PROP(Kernels, EveryInstructionSetAgreesWithDoubleInBfloat16, ()) {
  const Case c = random_case();
  expect_near_reference(c, rounded_to_bfloat16(c.network), Precision::kBfloat16, 2e-5);
}

// An input is rounded to 1/32767 of the limit, half a unit at most; weights of norm 2 and four
// layers: 1.5e-5 * 2^4 * a few.
RC_GTEST_PROP(Kernels, EveryInstructionSetAgreesWithDoubleInInt8, ()) {
  const Case c = random_case();
  expect_near_reference(c, rounded_to_int8(c.network), Precision::kInt8, 1e-3);
}

RC_GTEST_PROP(Kernels, SameInputsGiveTheSameBits, ()) {
  const Case c = random_case();
  for (const auto precision : {Precision::kFloat32, Precision::kBfloat16, Precision::kInt8}) {
    const Packed packed(c.network, precision);
    for (const Isa isa : isas()) {
      const auto first = packed.run(isa, c.inputs);
      std::memset(packed.scratch(), 0xFF, kernels::scratch_bytes(packed.view().header().widest));
      const auto second = packed.run(isa, c.inputs);
      RC_ASSERT(std::memcmp(first.data(), second.data(), first.size() * sizeof(float)) == 0);
    }
  }
}

TEST(Kernels, ActivationsStayWithinTheirStatedErrors) {
  const std::pair<Activation, double> limits[] = {{Activation::kSigmoid, model::kSigmoidError},
                                                  {Activation::kTanh, model::kTanhError}};
  for (const auto& [activation, limit] : limits) {
    const Packed packed(activation_only(activation), Precision::kFloat32);
    for (const Isa isa : isas()) {
      double worst = 0.0;
      for (int step = -400000; step <= 400000; ++step) {
        const float x = static_cast<float>(step) * 2.5e-4F;
        const auto y = packed.run(isa, {x});
        ASSERT_LE(std::abs(y[0]), 1.0F) << kernels::name_of(isa);
        worst = std::max(worst, std::abs(static_cast<double>(y[0]) -
                                         reference_activation(activation, static_cast<double>(x))));
      }
      EXPECT_LE(worst, limit) << kernels::name_of(isa);
    }
  }
}

TEST(Kernels, SaturatingActivationsAreFiniteForEveryNumber) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float extremes[] = {0.0F,   -0.0F,   1e-40F,   -1e-40F,  1e30F,
                            -1e30F, 3.4e38F, -3.4e38F, infinity, -infinity};
  for (const auto activation : {Activation::kSigmoid, Activation::kTanh}) {
    const Packed packed(activation_only(activation), Precision::kFloat32);
    for (const Isa isa : isas()) {
      for (const float x : extremes) {
        const auto y = packed.run(isa, {x});
        EXPECT_NEAR(y[0], reference_activation(activation, static_cast<double>(x)), 3e-7) << x;
      }
    }
  }
}

TEST(Kernels, ANanInputGivesNanOutputsWhereverItIs) {
  std::mt19937 random(5);
  const Network network = paper_like_network({37, 90, 41, 3}, random);
  for (const auto precision : {Precision::kFloat32, Precision::kBfloat16, Precision::kInt8}) {
    const Packed packed(network, precision);
    for (const Isa isa : isas()) {
      for (std::size_t at = 0; at < 37; ++at) {
        auto inputs = random_inputs(37, random);
        inputs[at] = std::numeric_limits<float>::quiet_NaN();
        for (const float y : packed.run(isa, inputs)) EXPECT_TRUE(std::isnan(y));
      }
    }
  }
}

TEST(Kernels, NoActivationLosesANan) {
  for (const auto activation :
       {Activation::kLinear, Activation::kSigmoid, Activation::kTanh, Activation::kRelu}) {
    for (const auto precision : {Precision::kFloat32, Precision::kBfloat16, Precision::kInt8}) {
      const Packed packed(activation_only(activation), precision);
      for (const Isa isa : isas()) {
        for (const float y : packed.run(isa, {std::numeric_limits<float>::quiet_NaN()})) {
          EXPECT_TRUE(std::isnan(y)) << kernels::name_of(isa);
        }
      }
    }
  }
}

TEST(Kernels, ExtremeInputsGiveFiniteOutputs) {
  std::mt19937 random(6);
  const Network network = paper_like_network({37, 90, 41, 3}, random);
  for (const auto precision : {Precision::kFloat32, Precision::kBfloat16, Precision::kInt8}) {
    const Packed packed(network, precision);
    for (const Isa isa : isas()) {
      for (const float x : {0.0F, 1e-40F, 1e30F, -1e30F}) {
        for (const float y : packed.run(isa, std::vector<float>(37, x))) {
          EXPECT_TRUE(std::isfinite(y)) << kernels::name_of(isa) << " " << x;
        }
      }
    }
  }
}

TEST(Kernels, Int8SumsDoNotOverflowWhateverTheWeights) {
  // All weights equal: at 127 units each, 4000 inputs at their limit would exceed 32 bits.
  Network network = {{4000, 16, Activation::kLinear, std::vector<float>(64000, 0.5F),
                      std::vector<float>(16, 0.0F)}};
  const Packed packed(network, Precision::kInt8, 1.0F);
  ASSERT_TRUE(packed.ok());
  for (const Isa isa : isas()) {
    const auto y = packed.run(isa, std::vector<float>(4000, 1.0F));
    EXPECT_NEAR(y[0], 2000.0F, 60.0F) << kernels::name_of(isa);  // 16 units of 127: 3 % coarse
  }
}

// So that the plugin may use them wherever their vector width is allowed.
TEST(Kernels, Int8IntegerDotProductsChangeNoBit) {
  std::mt19937 random(12);
  const Packed packed(paper_like_network({112, 130, 70, 33, 3}, random), Precision::kInt8);
  std::uniform_real_distribution<float> uniform(-8.0F, 8.0F);
  const std::pair<Isa, Isa> pairs[] = {{Isa::kAvx2, Isa::kAvx2Vnni},
                                       {Isa::kAvx512, Isa::kAvx512Vnni}};
  for (int i = 0; i < 200; ++i) {
    std::vector<float> inputs(112);
    for (float& input : inputs) input = uniform(random);
    for (const auto& [without, with] : pairs) {
      if (!kernels::is_supported(with)) continue;
      EXPECT_EQ(packed.run(without, inputs), packed.run(with, inputs)) << kernels::name_of(with);
    }
  }
}

TEST(Kernels, Int8WithInputMeansIsRightForTheAverageInput) {
  std::mt19937 random(9);
  const Network network = random_network({200, 64}, {Activation::kLinear}, random);
  const std::vector<float> means(200, 0.5F);
  auto layers = sources(network, 1.0F);
  const auto expected = reference_forward(network, means);
  const auto worst_error = [&] {
    const std::size_t bytes = kernels::packed_bytes(layers, Precision::kInt8);
    const auto block = aligned_bytes(bytes);
    kernels::PackedView view;
    EXPECT_TRUE(kernels::pack(layers, Precision::kInt8, {block.get(), bytes}));
    EXPECT_TRUE(kernels::open(block.get(), bytes, view));
    const auto scratch = aligned_bytes(kernels::scratch_bytes(view.header().widest));
    std::vector<float> y(64);
    kernels::forward_for(kernels::best_isa())(view, means.data(), y.data(), scratch.get());
    double worst = 0.0;
    for (std::size_t o = 0; o < y.size(); ++o) {
      worst = std::max(worst, std::abs(static_cast<double>(y[o]) - expected[o]));
    }
    return worst;
  };
  const double plain = worst_error();
  layers[0].input_means = means.data();
  const double corrected = worst_error();
  EXPECT_GT(plain, 1e-3);      // 200 roundings of half a unit of 3 * 0.14 / 127, times 0.5
  EXPECT_LT(corrected, 2e-4);  // left: the inputs' 15 bits
}

TEST(Kernels, TheChosenInstructionSetIsSupportedAndWithinTheLimit) {
  for (std::uint8_t limit = 0; limit < kernels::kIsaCount; ++limit) {
    const Isa isa = kernels::best_isa(static_cast<Isa>(limit));
    EXPECT_LE(static_cast<int>(isa), static_cast<int>(limit));
    EXPECT_TRUE(kernels::is_supported(isa));
    EXPECT_EQ(isa, kernels::best_isa(static_cast<Isa>(limit)));
  }
}

TEST(PackedNetwork, ATruncatedOrDamagedLayoutIsRefused) {
  std::mt19937 random(7);
  const Packed packed(paper_like_network({20, 30, 17, 3}, random), Precision::kInt8);
  kernels::PackedView view;
  for (std::size_t bytes = 0; bytes < packed.bytes(); ++bytes) {
    EXPECT_FALSE(kernels::open(packed.block(), bytes, view));
  }
  // Every byte of the header and the layer table that a kernel follows.
  constexpr std::size_t kHeaderFields = 16;
  const std::size_t table_end = sizeof(kernels::PackedHeader) + 3 * sizeof(kernels::PackedLayer);
  int accepted = 0;
  for (std::size_t at = 0; at < table_end; ++at) {
    if (at >= kHeaderFields && at < sizeof(kernels::PackedHeader)) continue;
    packed.block()[at] ^= std::byte{0x80};
    accepted += kernels::open(packed.block(), packed.bytes(), view) ? 1 : 0;
    packed.block()[at] ^= std::byte{0x80};
  }
  // Three of the four bytes of each input_step are a value, not a layout; its sign and exponent
  // are checked. The last layer is f32 and has none: any step is accepted there.
  EXPECT_LE(accepted, 3 + 3 + 4);
  EXPECT_TRUE(kernels::open(packed.block(), packed.bytes(), view));
  EXPECT_FALSE(kernels::open(packed.block() + 1, packed.bytes() - 1, view));
}

TEST(Pack, RefusesWhatIsNotFiniteOrDoesNotChain) {
  std::mt19937 random(8);
  Network network = paper_like_network({20, 30, 17, 3}, random);
  EXPECT_TRUE(Packed(network, Precision::kFloat32).ok());
  network[1].weights[5] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(Packed(network, Precision::kFloat32).ok());
  network[1].weights[5] = 3.4e38F;  // finite, but not in bfloat16
  EXPECT_FALSE(Packed(network, Precision::kBfloat16).ok());
  network[1].inputs = 29;
  EXPECT_EQ(kernels::packed_bytes(sources(network, 1.0F), Precision::kFloat32), 0U);
}

}  // namespace
}  // namespace ravencal::kernels_test
