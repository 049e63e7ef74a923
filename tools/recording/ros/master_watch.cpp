// SPDX-License-Identifier: Apache-2.0
#include "ros/master_watch.hpp"

#include <fmt/format.h>
#include <ros/connection_manager.h>
#include <ros/network.h>
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>

#include <chrono>
#include <utility>

namespace ravencal::ros_io {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(500);
constexpr auto kStopPoll = std::chrono::milliseconds(10);

void sleep_unless(const std::atomic<bool>& stop) {
  for (auto slept = std::chrono::milliseconds(0); slept < kPeriod && !stop.load();
       slept += kStopPoll)
    std::this_thread::sleep_for(kStopPoll);
}

bool ask_master(const std::string& method, const XmlRpc::XmlRpcValue& arguments,
                XmlRpc::XmlRpcValue& payload) {
  XmlRpc::XmlRpcValue response;
  return ros::master::execute(method, arguments, response, payload, false);
}

XmlRpc::XmlRpcValue arguments_of(const std::string& a, const std::string& b = {},
                                 const std::string& c = {}) {
  XmlRpc::XmlRpcValue arguments;
  arguments[0] = ros::this_node::getName();
  arguments[1] = a;
  if (!b.empty()) arguments[2] = b;
  if (!c.empty()) arguments[3] = c;
  return arguments;
}

}  // namespace

bool wait_for_master(const std::function<bool()>& keep_waiting) {
  while (!ros::master::check()) {
    if (!keep_waiting()) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

MasterWatch::MasterWatch() = default;

MasterWatch::~MasterWatch() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void MasterWatch::add_publication(std::string topic, std::string type) {
  publications_.push_back({std::move(topic), std::move(type)});
}
void MasterWatch::add_subscription(std::string topic, std::string type) {
  subscriptions_.push_back({std::move(topic), std::move(type)});
}
void MasterWatch::add_service(std::string name) { services_.push_back({std::move(name), {}}); }

void MasterWatch::start() {
  thread_ = std::thread([this] { run(); });
}

void MasterWatch::run() {
  while (!stop_.load()) {
    try {
      look();
    } catch (...) {  // XmlRpc throws what is no std::exception
      reachable_ = false;
    }
    sleep_unless(stop_);
  }
}

void MasterWatch::look() {
  XmlRpc::XmlRpcValue arguments;
  arguments[0] = ros::this_node::getName();
  XmlRpc::XmlRpcValue pid;
  if (!ask_master("getPid", arguments, pid) || pid.getType() != XmlRpc::XmlRpcValue::TypeInt) {
    reachable_ = false;
    return;
  }
  const int now = static_cast<int>(pid);
  if (master_pid_ != 0 && now != master_pid_) {
    register_all();
    ++restarts_;
  }
  master_pid_ = now;
  reachable_ = true;
}

/// What roscpp told the master before, once more. Existing connections are not touched.
void MasterWatch::register_all() {
  const std::string uri = ros::XMLRPCManager::instance()->getServerURI();
  XmlRpc::XmlRpcValue payload;
  for (const Entry& entry : publications_)
    (void)ask_master("registerPublisher", arguments_of(entry.name, entry.type, uri), payload);
  for (const Entry& entry : subscriptions_)
    (void)ask_master("registerSubscriber", arguments_of(entry.name, entry.type, uri), payload);
  const std::string service_uri = fmt::format("rosrpc://{}:{}", ros::network::getHost(),
                                              ros::ConnectionManager::instance()->getTCPPort());
  for (const Entry& entry : services_)
    (void)ask_master("registerService", arguments_of(entry.name, service_uri, uri), payload);
}

}  // namespace ravencal::ros_io
