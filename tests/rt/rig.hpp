// SPDX-License-Identifier: Apache-2.0
//
// What the plugin's tests share: models built in code, a robot state in good health, and a plugin
// loaded as a host loads it, ticked once per millisecond of made-up time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "model/calibration_model.hpp"
#include "model/packed_model.hpp"
#include "plugin_host/plugin_library.hpp"
#include "ravencal/plugin.h"

namespace ravencal::test {

/// A model with random weights of a fixed seed. Inputs are joint positions, motor positions, torque
/// and so on of the catalogue, in its order, `inputs` of them; outputs are joints 1 to 3 with a
/// mean of (0.02, -0.05, 0.003) and a scale of (0.004, 0.004, 0.0004).
model::CalibrationModel make_model(std::uint32_t inputs, const std::vector<std::uint32_t>& hidden,
                                   std::uint64_t seed = 1);

/// The same, with these inputs (feature_spec.hpp text form: "jpos.elbow", "...@3", "...~0.01").
model::CalibrationModel make_model(const std::vector<model::FeatureSpec>& features,
                                   const std::vector<std::uint32_t>& hidden,
                                   std::uint64_t seed = 1);

model::FeatureSpec plain(const std::string& channel);
model::FeatureSpec lagged(const std::string& channel, std::uint32_t rows);
model::FeatureSpec with_play(const std::string& channel, float half_width);
model::FeatureSpec mean_of(const std::string& channel, float time_constant_s);
model::FeatureSpec mean_of_abs(const std::string& channel, float time_constant_s);
/// "tau.elbow%0.1:jpos.elbow": over the travel of `position`.
model::FeatureSpec travel_mean_of(const std::string& channel, float travel_si,
                                  const std::string& position);
model::FeatureSpec travel_mean_of_abs(const std::string& channel, float travel_si,
                                      const std::string& position);

/// Homed, pedal up, every value in the middle of make_model's trained ranges.
ravencal_state healthy_state(std::int64_t t_ns = 0);

/// A model of joints 1 and 2 that passes its self-test, but gives a result that is not finite for a
/// state so provoked, which is within the trained ranges.
model::CalibrationModel make_model_with_a_flaw();
void provoke_flaw(ravencal_state& state);

/// A folder of this test process, removed at its end.
std::filesystem::path scratch_folder();

/// `precision`, calibrated where it needs to be on rows spread over make_model's trained ranges.
model::Packing packing_of(const model::CalibrationModel& model, model::packed::Precision precision);

/// Writes the model's blob into the scratch folder.
std::filesystem::path write_weights(
    const model::CalibrationModel& model, const std::string& name,
    model::packed::Precision precision = model::packed::Precision::kFloat32);

/// Plugin, instance, state and output; fails the test if the plugin cannot be loaded.
class Rig {
 public:
  explicit Rig(std::uint32_t max_isa = RAVENCAL_ISA_BEST);
  /// With settings changed from the defaults; those are without a step budget here and
  /// without a cap by the weights.
  explicit Rig(const std::function<void(ravencal_config&)>& configure);

  void load(const model::CalibrationModel& model,
            model::packed::Precision precision = model::packed::Precision::kFloat32);
  /// Presses or releases the pedal and waits until the plugin no longer holds on that account.
  void set_pedal(bool down);
  void enable(bool on = true) { api().enable(instance.get(), on ? 1 : 0); }
  /// One cycle: time advances a tick, step, cycle end. Returns step's status.
  std::int32_t tick();
  /// Ticks until that state, at most `limit` of them; returns whether it was reached.
  bool tick_until(std::int32_t wanted, int limit = 20000);
  [[nodiscard]] const ravencal_api& api() const { return library.api(); }

  plugin_host::Library library;
  ravencal_config config;
  plugin_host::Instance instance;
  ravencal_state state;
  ravencal_output output{};
};

}  // namespace ravencal::test
