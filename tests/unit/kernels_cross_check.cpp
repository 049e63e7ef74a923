// SPDX-License-Identifier: Apache-2.0
//
// kernels_cross_check: checks the kernels without a test library, for processors that only a cross
// compiler and an emulator have. 0: all checks pass; 1: a sentence names the failed one.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <limits>

#include "model/kernel_promise.hpp"
#include "unit/kernels_network.hpp"

namespace ravencal::kernels_test {
namespace {

int failures = 0;

void check(bool kept, const char* promise, Precision precision) {
  if (kept) return;
  ++failures;
  std::printf("%s: not kept in precision %d\n", promise, static_cast<int>(precision));
}

/// Against the double reference: f32 to its own roundings; bf16 and int8 to those of weights of
/// norm 2 in three layers (2^-9 and 2^-8 of a weight).
void check_precision(Precision precision, double tolerance) {
  std::mt19937 random(4);
  const Network network = paper_like_network({112, 130, 70, 33, 3}, random);
  const Packed packed(network, precision);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  for (int i = 0; i < 20; ++i) {
    std::vector<float> inputs(112);
    for (float& input : inputs) input = uniform(random);
    const auto expected = reference_forward(network, inputs);
    const auto outputs = packed.run(kernels::best_isa(), inputs);
    double worst = 0.0;
    for (std::size_t j = 0; j < expected.size(); ++j) {
      worst = std::max(worst, std::abs(static_cast<double>(outputs[j]) - expected[j]));
    }
    check(worst < tolerance, "near the reference", precision);
    const auto again = packed.run(kernels::best_isa(), inputs);
    check(std::memcmp(outputs.data(), again.data(), outputs.size() * sizeof(float)) == 0,
          "the same bits again", precision);
    inputs[static_cast<std::size_t>(i)] = std::numeric_limits<float>::quiet_NaN();
    for (const float y : packed.run(kernels::best_isa(), inputs)) {
      check(std::isnan(y), "NaN from NaN", precision);
    }
  }
}

/// Within one and the stated error, and NaN from NaN.
void check_activation(Activation activation, double error) {
  const Packed packed(
      {{1, 16, activation, std::vector<float>(16, 1.0F), std::vector<float>(16, 0.0F)}},
      Precision::kFloat32);
  for (int step = -4000; step <= 4000; ++step) {
    const float x = static_cast<float>(step) * 2.5e-3F;
    const float y = packed.run(kernels::best_isa(), {x})[0];
    const double expected = reference_activation(activation, static_cast<double>(x));
    check(std::abs(y) <= 1.0F, "an activation within one", Precision::kFloat32);
    check(std::abs(static_cast<double>(y) - expected) <= error, "an activation's error",
          Precision::kFloat32);
  }
  const float from_nan =
      packed.run(kernels::best_isa(), {std::numeric_limits<float>::quiet_NaN()})[0];
  check(std::isnan(from_nan), "NaN from an activation of NaN", Precision::kFloat32);
}

}  // namespace
}  // namespace ravencal::kernels_test

int main() {
  using namespace ravencal;
  kernels_test::check_precision(kernels::Precision::kFloat32, 1e-5);
  kernels_test::check_precision(kernels::Precision::kBfloat16, 0.05);
  kernels_test::check_precision(kernels::Precision::kInt8, 0.05);
  kernels_test::check_activation(model::Activation::kSigmoid, model::kSigmoidError);
  kernels_test::check_activation(model::Activation::kTanh, model::kTanhError);
  std::printf("%s: %d promises not kept\n", kernels::name_of(kernels::best_isa()),
              kernels_test::failures);
  return kernels_test::failures == 0 ? 0 : 1;
}
