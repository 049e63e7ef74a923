// SPDX-License-Identifier: Apache-2.0
//
// A ROS master of the test's own on a free port of loopback, the virtual RAVEN on it, and commands
// run beside them. Nothing waits for ever, and nothing is judged by how long it took.
#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace ravencal::test {

/// A shell command in the background, in a process group of its own, ended with the object.
class Background {
 public:
  explicit Background(const std::string& command);
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  ~Background();

  /// Exit code; 128 + signal if it was killed.
  int wait();
  int stop(int signal);
  [[nodiscard]] bool running();

 private:
  pid_t pid_;
  int status_ = 0;
};

/// A port of 127.0.0.1 that is free. Below those that the system gives to outgoing connections, of
/// which programs of ROS make many; neighbouring processes begin to look at different ones.
int free_port();
/// Asks until it is so; false only where it hangs.
bool wait_until(const std::function<bool()>& so);
/// Whether a shell finds the program.
bool installed(const char* program);
std::string text_of(const std::filesystem::path& path);

class RosRig : public testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  void start_master();
  void kill_master();
  /// The virtual robot with these options, in the background; returns when its topics are there.
  void start_robot(const std::string& options);
  void kill_robot(int signal);

  /// Runs a shell command in the test's folder and environment; what it prints goes to `log`.
  [[nodiscard]] int run(const std::string& command, const std::string& log = "log.txt") const;
  [[nodiscard]] std::unique_ptr<Background> start(const std::string& command,
                                                  const std::string& log) const;
  /// `ravencal-ros run` on the short path, robust against a machine that is busy.
  [[nodiscard]] std::string run_command(const std::string& more, double stale_s = 20.0,
                                        double wait_s = 600.0) const;
  /// Calls a service of the robot with Debian's rosservice.
  [[nodiscard]] bool press(const std::string& call) const;
  [[nodiscard]] std::string log(const std::string& name) const { return text_of(folder_ / name); }
  void write_path(const std::string& name, double seconds, double elbow_deg) const;

  std::filesystem::path folder_;

 private:
  int port_ = 0;
  std::string environment_;
  std::unique_ptr<Background> master_;
  std::unique_ptr<Background> robot_;
};

}  // namespace ravencal::test
