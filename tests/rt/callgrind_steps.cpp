// SPDX-License-Identifier: Apache-2.0
//
// callgrind_steps light|paper f32|bf16|int8: what callgrind_test runs under valgrind. Makes one
// step of the plugin per situation and has callgrind write down its instructions, named after the
// situation. Without valgrind it does nothing but the steps.
#include <valgrind/callgrind.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/run_level.hpp"
#include "rt/rig.hpp"
#include "rt_plugin/fp_mode.hpp"
#include "rt_plugin/kernels/forward.hpp"

namespace ravencal::test {
namespace {

/// Counts what `work` does. Instrumentation is off elsewhere, where it would only take time.
template <typename Work>
[[gnu::noinline]] void count(const char* situation, const Work& work) {
  CALLGRIND_START_INSTRUMENTATION;
  CALLGRIND_ZERO_STATS;
  CALLGRIND_TOGGLE_COLLECT;
  work();
  CALLGRIND_TOGGLE_COLLECT;
  CALLGRIND_DUMP_STATS_AT(situation);
  CALLGRIND_STOP_INSTRUMENTATION;
}

void count_step(Rig& rig, const char* situation) {
  rig.api().observe_cycle_end(rig.instance.get(), &rig.state);
  rig.state.t_ns += 1'000'000;
  count(situation, [&] { rig.api().step(rig.instance.get(), &rig.state, &rig.output); });
}

/// Instructions that depend on the data, for the test of the counter itself.
void count_loops(const char* situation, int loops) {
  count(situation, [loops] {
    for (int i = 0; i < loops; ++i) asm volatile("" ::: "memory");
  });
}

using Change = std::function<void(ravencal_state&)>;

void set_arm(ravencal_state& state, float value) {
  for (std::size_t i = 0; i < RAVENCAL_SLOTS; ++i) {
    state.arm[0].jpos_ji[i] = value;
    state.arm[0].mpos_rad[i] = value;
    state.arm[0].jvel_ji[i] = value;
    state.arm[0].mvel_rad_per_s[i] = value;
    state.arm[0].tau_n_m[i] = value;
  }
}

struct FreeMemory {
  void operator()(std::byte* memory) const { std::free(memory); }
};
using Memory = std::unique_ptr<std::byte[], FreeMemory>;

Memory aligned(std::size_t bytes) {
  constexpr std::size_t kLine = kernels::kLineBytes;
  return Memory(static_cast<std::byte*>(std::aligned_alloc(kLine, kernels::padded(bytes, kLine))));
}

class Situations {
 public:
  Situations(bool paper, model::packed::Precision precision)
      : model_(paper ? make_model(208, {600, 500, 400}) : make_model(112, {128, 64, 32})),
        precision_(precision),
        rig_(RAVENCAL_ISA_AVX2) {
    rig_.load(model_, precision_);
    rig_.enable();
    const auto packed = model::pack_layers(model_, packing_of(model_, precision_));
    if (!packed.ok()) std::abort();
    block_ = aligned(packed->size());
    std::copy(packed->begin(), packed->end(), block_.get());
    if (!kernels::open(block_.get(), packed->size(), view_)) std::abort();
    scratch_ = aligned(kernels::scratch_bytes(view_.header().widest));
  }

  void run() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    in_every_state();
    in_fault();
    with_means();
    with_data("step_again", [](ravencal_state&) {});
    with_data("step_zeros", [](ravencal_state& state) { set_arm(state, 0.0F); });
    with_data("step_denormal", [](ravencal_state& state) { set_arm(state, 1e-41F); });
    with_data("step_largest", [](ravencal_state& state) { set_arm(state, 3.4e38F); });
    with_data("step_smallest", [](ravencal_state& state) { set_arm(state, -3.4e38F); });
    with_data("step_infinite", [](ravencal_state& state) { set_arm(state, kInfinity); });
    with_data("step_nan", [](ravencal_state& state) { set_arm(state, kNan); });
    with_data("step_one_nan", [](ravencal_state& state) { state.arm[0].tau_n_m[1] = kNan; });
    with_data("step_range_end", [](ravencal_state& state) { state.arm[0].jpos_ji[0] += 0.4F; });
    network("network_halves", 0.5F);
    network("network_zeros", 0.0F);
    network("network_denormal", 1e-41F);
    network("network_largest", 3.4e38F);
    network("network_smallest", -3.4e38F);
    network("network_infinite", kInfinity);
    network("network_nan", kNan);
    count_loops("ring_short", 100);
    count_loops("ring_long", 101);
  }

 private:
  void in_every_state() {
    Rig rig(RAVENCAL_ISA_AVX2);
    count_step(rig, "without_weights");
    rig.load(model_, precision_);
    rig.tick();  // takes the weights
    count_step(rig, "state_off");
    rig.state.runlevel = core::kEmergencyStop;
    rig.enable();
    rig.tick();
    count_step(rig, "state_armed");
    rig.state = healthy_state(rig.state.t_ns);
    rig.tick_until(RAVENCAL_STATE_FADING_IN);
    rig.tick();
    count_step(rig, "state_fading_in");
    rig.tick_until(RAVENCAL_STATE_ACTIVE);
    rig.tick();
    count_step(rig, "state_active");
    rig.state.arm[0].tau_n_m[0] = std::numeric_limits<float>::quiet_NaN();
    rig.tick_until(RAVENCAL_STATE_HOLD);
    count_step(rig, "state_hold");
    rig.tick_until(RAVENCAL_STATE_FADING_OUT);
    rig.tick();
    count_step(rig, "state_fading_out");
    rig.tick_until(RAVENCAL_STATE_CONSTANT);
    rig.tick();
    count_step(rig, "state_constant");
  }

  /// A network of another size, whose finite weights give no finite output in one corner.
  void in_fault() {
    Rig rig(RAVENCAL_ISA_AVX2);
    rig.load(make_model_with_a_flaw());
    rig.enable();
    rig.tick_until(RAVENCAL_STATE_ACTIVE);
    rig.tick();
    count_step(rig, "flawed_active");
    provoke_flaw(rig.state);
    rig.tick_until(RAVENCAL_STATE_FAULT);
    rig.tick();
    count_step(rig, "flawed_fault");
  }

  /// Inputs that are exponential means.
  void with_means() {
    std::vector<model::FeatureSpec> features;
    for (const char* joint : {"shoulder", "elbow", "insertion"}) {
      for (const char* field : {"jpos.", "mpos.", "mvel.", "tau."}) {
        features.push_back(mean_of(std::string(field) + joint, 0.5F));
        features.push_back(mean_of_abs(std::string(field) + joint, 100.0F));
      }
    }
    Rig rig(RAVENCAL_ISA_AVX2);
    rig.load(make_model(features, {}));
    rig.enable();
    rig.tick_until(RAVENCAL_STATE_ACTIVE);
    rig.tick();
    count_step(rig, "means_again");
    set_arm(rig.state, -0.0625F);
    count_step(rig, "means_negative");
    set_arm(rig.state, 0.0F);
    count_step(rig, "means_zeros");
    set_arm(rig.state, 1e-41F);
    count_step(rig, "means_denormal");
  }

  void with_data(const char* situation, const Change& change) {
    rig_.state = healthy_state(rig_.state.t_ns);
    if (!rig_.tick_until(RAVENCAL_STATE_ACTIVE)) std::abort();
    rig_.tick();
    change(rig_.state);
    count_step(rig_, situation);
  }

  /// The kernels alone, denormals flushed as in a step.
  void network(const char* situation, float value) {
    const std::vector<float> inputs(model_.layers.front().weights.cols(), value);
    std::array<float, 16> outputs{};
    const rt::OwnFloatMode own_mode;
    count(situation, [&] { forward_(view_, inputs.data(), outputs.data(), scratch_.get()); });
  }

  model::CalibrationModel model_;
  model::packed::Precision precision_;
  Rig rig_;
  Memory block_;
  Memory scratch_;
  kernels::PackedView view_;
  kernels::Forward forward_ = kernels::forward_for(kernels::best_isa(kernels::Isa::kAvx2));
};

}  // namespace
}  // namespace ravencal::test

int main(int argc, char** argv) {
  using ravencal::model::packed::Precision;
  if (argc != 3) {
    std::fputs("usage: callgrind_steps light|paper f32|bf16|int8\n", stderr);
    return 2;
  }
  const auto precision = ravencal::model::precision_of(argv[2]);
  if (!precision.ok()) return 2;
  ravencal::test::Situations(std::string_view(argv[1]) == "paper", *precision).run();
  return 0;
}
