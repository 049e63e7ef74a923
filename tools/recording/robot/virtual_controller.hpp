// SPDX-License-Identifier: Apache-2.0
//
// The RAVEN-II's control process on two digital twins, one per arm, cycle by cycle: run levels from
// E-stop, start button and pedal; homing; CRTK joint commands; the plugin at its hook; and what the
// controller publishes. Behaves as the plant's ControllerBranch does; without one, as `crtk`. Knows
// no ROS and no clock. cycle() is real-time safe: it neither allocates nor calls the system.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "physics/raven_message.hpp"
#include "robot/follower.hpp"
#include "robot/joint_commands.hpp"

namespace ravencal::robot {

struct VirtualControllerOptions {
  std::uint64_t seed = 1;
  std::uint64_t homing_seed = 1;
  bool homed = false;  ///< starts homed, pedal up, instead of at the E-stop
  std::string plugin;  ///< libravencal_plugin.so, for the plant's arm; empty: none
  std::string weights;
  std::string telemetry;
};

/// Buttons and pedal.
enum class Button : std::uint8_t {
  kEmergencyStop,         ///< pressed
  kEmergencyStopRelease,  ///< released; the robot stays stopped until kStart
  kStart,                 ///< the silver button: initialise, home if that has not been done
  kPedalDown,
  kPedalUp,
  kUnhome,  ///< CRTK "unhome" and "home": stops; the next start homes
};

/// What one cycle leaves to publish.
struct CycleOutput {
  std::int64_t t_ns = 0;            ///< robot time since it was switched on
  physics::RavenMessage message{};  ///< raven_state in its own units, the plant's arm as "this" arm
  std::int32_t runlevel = kEmergencyStop;
  OperatingState operating = OperatingState::kDisabled;
  bool homed = false;
  bool busy = false;
  std::array<double, 3> encoders_ji{};  ///< external encoders of the plant's arm
  std::array<std::int64_t, 3> encoder_counts{};
  std::array<double, 3> correction_ji{};  ///< of the plugin
};

class VirtualController {
 public:
  /// Errors: a plant that is no RAVEN-II. A plugin or weights that cannot be loaded are an error,
  /// too, though the real controller would go on without: here somebody asked for them.
  static core::Result<VirtualController> create(const physics::Plant& plant,
                                                const VirtualControllerOptions& options);
  VirtualController(VirtualController&&) noexcept;
  VirtualController& operator=(VirtualController&&) noexcept;
  VirtualController(const VirtualController&) = delete;
  VirtualController& operator=(const VirtualController&) = delete;
  ~VirtualController();

  /// Between two cycles, from the thread that runs them.
  void press(Button button) noexcept;
  void command(CrtkArm arm, CommandKind kind, const Eigen::Vector3d& joints) noexcept;

  const CycleOutput& cycle() noexcept;

  [[nodiscard]] double rate_hz() const;
  [[nodiscard]] bool gold() const;         ///< whether the plant's arm is the gold one
  [[nodiscard]] CrtkArm crtk_arm() const;  ///< whose commands move the plant's arm

 private:
  struct Impl;
  explicit VirtualController(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::robot
