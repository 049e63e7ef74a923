// SPDX-License-Identifier: Apache-2.0
//
// Built where ROS is not installed.
#include "quadrature_reader/ros/bridge.hpp"

namespace ravencal::quadrature_reader {

struct RosBridge::Impl {};

core::Result<std::unique_ptr<RosBridge>> RosBridge::create(const RosBridgeOptions& /*options*/) {
  return core::Error{core::ErrorCode::kUsage,
                     "this build knows no ROS; install libroscpp-dev and build ravencal again"};
}

RosBridge::RosBridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RosBridge::~RosBridge() = default;
void RosBridge::offer(std::int64_t /*t_ns*/, std::span<const AxisSample> /*samples*/) {}
core::Status RosBridge::finish() { return {}; }
RosBridgeStatus RosBridge::status() const { return {}; }

}  // namespace ravencal::quadrature_reader
