// SPDX-License-Identifier: Apache-2.0
//
// Watches the ROS master from a thread of its own. Connections between nodes outlive a master, but
// a restarted master has no registrations. This registers the node's topics and services again, so
// that rostopic, rosbag and new nodes find them.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace ravencal::ros_io {

/// Waits for a master until `keep_waiting` says no; false then. ros::init must have been called.
bool wait_for_master(const std::function<bool()>& keep_waiting);

class MasterWatch {
 public:
  MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;
  ~MasterWatch();

  /// Names and types as given to ROS; before start().
  void add_publication(std::string topic, std::string type);
  void add_subscription(std::string topic, std::string type);
  void add_service(std::string name);
  void start();

  [[nodiscard]] bool reachable() const { return reachable_.load(); }
  /// How many times another master was met.
  [[nodiscard]] int restarts() const { return restarts_.load(); }

 private:
  struct Entry {
    std::string name;
    std::string type;
  };
  void run();
  void look();
  void register_all();

  std::vector<Entry> publications_;
  std::vector<Entry> subscriptions_;
  std::vector<Entry> services_;
  int master_pid_ = 0;  // watch thread
  std::atomic<bool> reachable_{true};
  std::atomic<int> restarts_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace ravencal::ros_io
