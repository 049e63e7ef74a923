// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "host/robot_source.hpp"
#include "physics/raven_twin.hpp"
#include "plugin_host/robot_state.hpp"

namespace ravencal::host {
namespace {

using Eigen::Vector3d;

constexpr double kApproachS = 5.0;  // smooth move from home to the trajectory's start

class TwinSource final : public RobotSource {
 public:
  TwinSource(physics::RavenTwin twin, trajectory::Trajectory trajectory,
             const physics::Plant& plant)
      : twin_(std::move(twin)),
        trajectory_(std::move(trajectory)),
        rate_hz_(plant.robot.control_rate_hz),
        arm_(plant.robot.arm) {}

  [[nodiscard]] std::string arm() const override { return arm_; }

  void go_to_start() {
    twin_.home();
    const Vector3d from = twin_.estimate_ji();
    const Vector3d to = trajectory_.at(0.0);
    const auto approach = static_cast<std::int64_t>(kApproachS * rate_hz_);
    for (std::int64_t i = 1; i <= approach; ++i) {
      const double along = static_cast<double>(i) / static_cast<double>(approach);
      twin_.begin_cycle();
      rest_ = plugin_host::to_si(
          twin_.end_cycle(from + 0.5 * (1.0 - std::cos(std::numbers::pi * along)) * (to - from)));
    }
  }

  void rest(ravencal_state& state) override {
    plugin_host::fill_state(rest_, twin_.t_ns(), true, state);
  }

  [[nodiscard]] std::int64_t cycles() const override {
    return static_cast<std::int64_t>(trajectory_.duration_s() * rate_hz_) + 1;
  }

  void begin(ravencal_state& state) override {
    t_ns_ = twin_.t_ns();
    plugin_host::fill_state(plugin_host::to_si(twin_.begin_cycle()), t_ns_, true, state);
    const Vector3d truth = twin_.truth().encoder_ji;
    truth_ji_ = {truth[0], truth[1], truth[2]};
  }

  void end(ravencal_state& state) override {
    const double t_s = static_cast<double>(cycle_++) / rate_hz_;
    plugin_host::fill_state(plugin_host::to_si(twin_.end_cycle(trajectory_.at(t_s))), t_ns_, true,
                            state);
  }

  [[nodiscard]] Joints truth_ji() const override { return truth_ji_; }

 private:
  physics::RavenTwin twin_;
  trajectory::Trajectory trajectory_;
  double rate_hz_;
  std::string arm_;
  plugin_host::CatalogueValues rest_{};
  std::int64_t cycle_ = 0;
  std::int64_t t_ns_ = 0;
  Joints truth_ji_{};
};

}  // namespace

core::Result<std::unique_ptr<RobotSource>> make_twin_source(
    const physics::Plant& plant, const trajectory::Trajectory& trajectory,
    const TwinSourceOptions& options) {
  physics::TwinOptions twin_options;
  twin_options.seed = options.seed;
  twin_options.homing_seed = options.homing_seed;
  RAVENCAL_ASSIGN_OR_RETURN(physics::RavenTwin twin,
                            physics::RavenTwin::create(plant, twin_options));
  auto source = std::make_unique<TwinSource>(std::move(twin), trajectory, plant);
  source->go_to_start();
  return std::unique_ptr<RobotSource>(std::move(source));
}

}  // namespace ravencal::host
