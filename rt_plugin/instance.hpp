// SPDX-License-Identifier: Apache-2.0
//
// State of one plugin instance, in the host's memory. Each group says which thread uses it.
#pragma once

#include <array>
#include <cstdint>

#include "ravencal/plugin.h"
#include "rt_plugin/commanded_motion.hpp"
#include "rt_plugin/desired_joints.hpp"
#include "rt_plugin/envelope.hpp"
#include "rt_plugin/flight.hpp"
#include "rt_plugin/guards.hpp"
#include "rt_plugin/homing_constant.hpp"
#include "rt_plugin/loaded_model.hpp"
#include "rt_plugin/operation.hpp"
#include "rt_plugin/overruns.hpp"
#include "rt_plugin/requests.hpp"
#include "rt_plugin/shared_counters.hpp"
#include "rt_plugin/stopwatch.hpp"
#include "rt_plugin/succession.hpp"
#include "rt_plugin/swap.hpp"
#include "rt_plugin/telemetry.hpp"

struct alignas(64) ravencal_instance {
  explicit ravencal_instance(const ravencal_config& settings) noexcept
      : config(settings),
        models(swap),
        operation(settings),
        envelope(settings),
        guards(settings),
        overruns(settings),
        desired(settings) {
    counters.struct_size = sizeof counters;
    last_load.message[0] = '\0';
  }

  const ravencal_config config;
  const ravencal::rt::Stopwatch stopwatch;

  // Between the loading and the real-time thread.
  ravencal::rt::ModelSwap swap;

  // Real-time thread only.
  ravencal::rt::Succession models;
  ravencal::rt::Operation operation;             ///< asked for by any thread
  ravencal::rt::Requests requests;               ///< asked for by programs
  ravencal::rt::HomingConstant homing_constant;  ///< asked for by the loading thread and programs
  ravencal::rt::Envelope envelope;
  ravencal::rt::StateGuards guards;
  ravencal::rt::OverrunWatch overruns;
  ravencal_counters counters{};
  ravencal_state published{};  ///< as the controller published it last
  bool has_published = false;
  ravencal::rt::CommandedMotion commanded;  ///< in the cycle published last
  ravencal::rt::DesiredJoints desired;
  std::int64_t armed_ns = 0;  ///< zero of the time channel

  // Written by the real-time thread, read by any.
  ravencal::rt::SharedCounters shared_counters;
  ravencal::rt::FlightRecorder flight;
  ravencal::rt::Telemetry telemetry;  ///< opened at create

  // Loading thread only.
  ravencal::rt::LoadFailure last_load;
  ravencal_info loaded{};  ///< of the last accepted blob
};

namespace ravencal::rt {

/// [rt] ravencal_info.checksum of the weights in use; 0 without any.
inline std::uint32_t weights_checksum(const ravencal_instance& self) noexcept {
  const LoadedModel* const model = self.models.current();
  return model == nullptr ? 0 : model->info().checksum;
}

}  // namespace ravencal::rt
