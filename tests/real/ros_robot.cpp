// SPDX-License-Identifier: Apache-2.0
//
// Stands in for the robot's controller: publishes a recording's states as /ravenstate, at a rate,
// with the stamps of now. usage: ros_robot STATES.db RATE_HZ SECONDS
#include <fmt/format.h>
#include <ros/ros.h>

#include <cstdlib>

#include "core/units.hpp"
#include "record/load.hpp"
#include "record/raven_state_message.hpp"
#include "record/ros_raw_message.hpp"

int main(int argc, char** argv) {
  using namespace ravencal;
  if (argc != 4) return 2;
  const auto recording = record::load_recording(argv[1], {});
  if (!recording.ok()) {
    fmt::print(stderr, "{}\n", recording.error().message);
    return 3;
  }
  const double rate_hz = std::strtod(argv[2], nullptr);
  const double seconds = std::strtod(argv[3], nullptr);
  ros::init(argc, argv, "r2_control", ros::init_options::NoRosout);
  ros::NodeHandle node;
  const record::RosMessageType& type = record::raven_state_type();
  ros::AdvertiseOptions topic("ravenstate", 1000, std::string(type.md5), std::string(type.name),
                              std::string(type.definition));
  ros::Publisher publisher = node.advertise(topic);
  ros::Rate rate(rate_hz);
  const auto rows = static_cast<Eigen::Index>(rate_hz * seconds);
  for (Eigen::Index row = 0; row < rows && ros::ok(); ++row) {
    record::RavenStateMessage state;
    const ros::Time now = ros::Time::now();
    state.stamp_ns = static_cast<std::int64_t>(now.toNSec());
    state.dt_ns = static_cast<std::int64_t>(1e9 / rate_hz);
    for (std::size_t i = 0; i < core::kCatalogueSize; ++i) {
      const auto column = recording->column(core::catalogue()[i].name);
      if (!column) continue;
      const auto unit = core::find_unit(core::catalogue()[i].message_unit);
      state.values[i] = recording->samples(row % recording->rows(), *column) / unit->to_si;
    }
    publisher.publish(record::RosRawMessage{&type, record::encode_raven_state(state, true)});
    rate.sleep();
  }
  return 0;
}
