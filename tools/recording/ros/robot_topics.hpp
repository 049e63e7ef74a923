// SPDX-License-Identifier: Apache-2.0
//
// What the virtual RAVEN publishes after a cycle: raven_state, operating states, joints, poses and
// the external encoders, in the units and with the quirks of the controller. One thread.
#pragma once

#include <array>
#include <cstdint>

#include "physics/plant.hpp"
#include "robot/virtual_controller.hpp"
#include "ros/master_watch.hpp"
#include "ros/raw_topics.hpp"

namespace ravencal::ros_io {

class RobotTopics {
 public:
  /// `start_ns`: CLOCK_REALTIME at the robot's time 0. Publications are made known to `watch`.
  RobotTopics(ros::NodeHandle& node, MasterWatch& watch, const physics::Plant& plant, bool encoders,
              std::int64_t start_ns);

  void publish(const robot::CycleOutput& output);

 private:
  struct ArmTopics {
    ros::Publisher operating_state;
    ros::Publisher measured_js;
    ros::Publisher setpoint_js;
    ros::Publisher measured_cp;
    ros::Publisher setpoint_cp;
  };
  ros::Publisher make(ros::NodeHandle& node, MasterWatch& watch, const std::string& topic,
                      const record::RosMessageType& type);
  void publish_state(const robot::CycleOutput& output, std::int64_t stamp_ns);
  void publish_arm(const robot::CycleOutput& output, std::size_t arm, std::int64_t stamp_ns);
  void publish_encoders(const robot::CycleOutput& output, std::int64_t stamp_ns);

  bool gold_;
  bool encoders_;
  std::int64_t start_ns_;
  std::int64_t last_stamp_ns_ = 0;
  std::int64_t next_reading_ns_ = 0;  // robot time
  std::int64_t reading_period_ns_;
  std::int64_t reading_latency_ns_;
  ros::Publisher ravenstate_;
  ros::Publisher operating_state_;
  std::array<ArmTopics, 2> arms_;
  ros::Publisher ext_jpos_;
  ros::Publisher joint_enc_;
};

}  // namespace ravencal::ros_io
