// SPDX-License-Identifier: Apache-2.0
//
// All that one plugin instance knows, in the host's memory. Beside each group: which thread.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "ravencal/plugin.h"
#include "rt_plugin/envelope.hpp"
#include "rt_plugin/flight.hpp"
#include "rt_plugin/loaded_model.hpp"
#include "rt_plugin/swap.hpp"
#include "rt_plugin/telemetry.hpp"

struct alignas(64) ravencal_instance {
  explicit ravencal_instance(const ravencal_config& settings) noexcept
      : config(settings), envelope(settings) {
    counters.struct_size = sizeof counters;
    last_load.message[0] = '\0';
  }

  const ravencal_config config;

  // Real-time thread only.
  ravencal::rt::LoadedModel* model = nullptr;
  ravencal::rt::Envelope envelope;
  ravencal_state published{};  ///< as the controller published it last
  bool has_published = false;
  bool has_stepped = false;
  std::int64_t last_step_ns = 0;
  std::int64_t armed_ns = 0;  ///< zero of the time channel

  // Written by the real-time thread, read by any: through std::atomic_ref.
  ravencal_counters counters{};
  ravencal::rt::FlightRecorder flight;
  ravencal::rt::Telemetry telemetry;  ///< opened at create

  // Written by any thread, read by the real-time thread.
  std::atomic<std::int32_t> enabled{0};
  std::atomic<std::int32_t> reset_requested{0};

  // Between the loading and the real-time thread.
  ravencal::rt::ModelSwap swap;

  // Loading thread only.
  ravencal::rt::LoadFailure last_load;
  ravencal_info loaded{};  ///< of the last accepted blob
};
