// SPDX-License-Identifier: Apache-2.0
//
// The encoder driver's place among ROS 1 nodes: publishes `joint_enc` (counts) and `ext_jpos`
// (rad, rad, m) as sensor_msgs/JointState, and records `ravenstate` beside the truth. ROS runs in
// threads of its own, which get rows through a wait-free ring, so neither reader nor writer waits
// for the master or a subscriber. Rows that ROS takes too slowly are counted and not published; the
// recording has them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "quadrature_reader/axis.hpp"

namespace ravencal::quadrature_reader {

struct RosBridgeOptions {
  std::vector<std::string> joints;        ///< in the order of offer()'s samples, at most 16
  double rate_hz = 100.0;                 ///< of both topics; the authors' tools expect about 100
  std::filesystem::path robot_recording;  ///< begun with the first ravenstate
  std::string arm = "gold";               ///< whose half of ravenstate is the calibrated arm
};

struct RosBridgeStatus {
  bool connected = false;           ///< a master has been found
  std::int64_t published = 0;       ///< moments, each on both topics
  std::int64_t not_published = 0;   ///< ROS was too slow
  std::int64_t states = 0;          ///< rows of the robot's recording
  std::int64_t states_refused = 0;  ///< messages that could not be recorded
  std::string trouble;              ///< the last reason, empty if none
};

class RosBridge {
 public:
  /// Starts ROS's threads; a missing master is waited for. Once per process. Error if this build
  /// has no ROS.
  static core::Result<std::unique_ptr<RosBridge>> create(const RosBridgeOptions& options);
  RosBridge(const RosBridge&) = delete;
  RosBridge& operator=(const RosBridge&) = delete;
  ~RosBridge();  ///< as finish()

  /// Writer thread only; never waits. `t_ns` is CLOCK_MONOTONIC; positions that are not valid are
  /// published as NaN, a moment at which none is valid not at all.
  void offer(std::int64_t t_ns, std::span<const AxisSample> samples);

  /// Leaves ROS and closes the robot's recording; the error is that of closing it.
  core::Status finish();
  /// Any thread.
  [[nodiscard]] RosBridgeStatus status() const;

 private:
  struct Impl;
  explicit RosBridge(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::quadrature_reader
