// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <vector>

#include "record/recording.hpp"
#include "record/time_range.hpp"
#include "simulation/follow.hpp"

namespace ravencal::python {

/// ravencal.Recording: never changes, because arrays look into it.
struct HeldRecording {
  record::Recording recording;
  std::string profile{};                              ///< as it was asked for
  record::TimeRange range{};                          ///< likewise
  std::vector<simulation::FollowedJoint> followed{};  ///< of simulate(follow=...)
};

using RecordingPointer = std::shared_ptr<const HeldRecording>;

/// One recording or a sequence of them; none of None.
std::vector<RecordingPointer> recordings_of(const pybind11::object& given);

}  // namespace ravencal::python
