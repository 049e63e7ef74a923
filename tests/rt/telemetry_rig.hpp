// SPDX-License-Identifier: Apache-2.0
//
// What the tests of telemetry and flight recorder share: plugins that write telemetry, models that
// fail, and a robot that gives trouble now and then.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "core/run_level.hpp"
#include "monitor/telemetry_reader.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {

/// A rig whose plugin writes telemetry; `name` empty: one without.
inline core::Status give_telemetry(Rig& rig, const std::string& name) {
  std::strncpy(rig.config.telemetry_name, name.c_str(), sizeof rig.config.telemetry_name - 1);
  auto instance = plugin_host::Instance::create(rig.library, rig.config);
  if (!instance.ok()) return instance.error();
  rig.instance = std::move(instance).value();
  return {};
}

/// Goes where the network of make_model_with_a_flaw() overflows.
inline void overflow(ravencal_state& state) {
  const ravencal_state healthy = healthy_state();
  state.arm[0].jpos_ji[0] = healthy.arm[0].jpos_ji[0] + 0.5F;
  state.arm[0].jpos_ji[1] = healthy.arm[0].jpos_ji[1] - 0.5F;
}

inline monitor::TelemetryReader opened(const std::string& name) {
  core::Result<monitor::TelemetryReader> reader = monitor::TelemetryReader::open(name);
  if (!reader.ok()) {
    ADD_FAILURE() << reader.error().message;
    std::abort();
  }
  return std::move(reader).value();
}

/// What a robot may do to a plugin in its tick `number`, the same for every rig: slow motion, and
/// trouble now and then.
inline void disturb(ravencal_state& state, std::mt19937& random, int number) {
  state = healthy_state(state.t_ns);
  for (int j = 0; j < RAVENCAL_SLOTS; ++j) {
    state.arm[0].jpos_ji[j] += 0.2F * std::sin(static_cast<float>(number) * 0.002F + 2.0F * j);
    state.arm[0].enc_counts[j] = number * (j + 1);
  }
  switch (random() % 20'000) {
    case 0:
      state.arm[0].jpos_ji[random() % 8] = std::numeric_limits<float>::quiet_NaN();
      break;
    case 1:
      state.runlevel = core::kEmergencyStop;
      break;
    case 2:
      state.t_ns += 40'000'000;
      break;
    case 3:
      state.arm[0].jpos_ji[1] = 1e-41F;
      break;
    default:
      break;
  }
}

/// All that step wrote, but how long it took.
inline bool same_output(const ravencal_output& a, const ravencal_output& b) {
  return std::memcmp(&a, &b, offsetof(ravencal_output, step_ns)) == 0;
}

}  // namespace ravencal::test
