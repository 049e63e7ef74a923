// SPDX-License-Identifier: Apache-2.0
#include "simulation/follow.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/joint_error.hpp"
#include "physics/plant_effort.hpp"
#include "physics/predict/predict.hpp"
#include "physics/predict/run_drive.hpp"
#include "physics/predict/smoother.hpp"

namespace ravencal::simulation {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Role;

constexpr double kBristle_ji = 1e-5;  ///< over which friction builds up where the plant is silent

/// One joint's recorded signals at the joint; empty where not recorded.
struct Recorded {
  VectorXd estimate, motor, desired, truth, effort;

  [[nodiscard]] const VectorXd& measured() const { return motor.size() > 0 ? motor : estimate; }
  [[nodiscard]] const VectorXd& believed() const {
    if (estimate.size() > 0) return estimate;
    return motor.size() > 0 ? motor : desired;
  }
};

class Follower {
 public:
  Follower(const physics::Plant& plant, const record::Recording& recording,
           const FollowOptions& options)
      : plant_(plant), options_(options), out_{recording, {}} {
    t_s_.resize(recording.rows());
    for (Index i = 0; i < t_s_.size(); ++i) {
      t_s_[i] = 1e-9 * static_cast<double>(recording.t_ns[static_cast<std::size_t>(i)] -
                                           recording.t_ns.front());
    }
    mark_episodes();
    find_power_channel();
    for (const physics::Joint& joint : plant.joints) recorded_.push_back(signals_of(joint));
    out_.recording.meta["source"] = "ravencal simulate --follow: simulated, not a robot";
  }

  core::Result<FollowResult> run() {
    std::vector<VectorXd> positions;
    for (const Recorded& r : recorded_) positions.push_back(r.believed());
    weights_ = physics::holding_efforts(plant_, positions);
    physics::add_external_loads(plant_, external_loads(), weights_);
    for (std::size_t j = 0; j < recorded_.size(); ++j) {
      const Recorded& r = recorded_[j];
      const bool controlled = r.desired.size() > 0 && law(j).has_value() && !options_.open_loop;
      const bool driven = r.measured().size() > 0 && (r.effort.size() > 0 || controlled);
      if (driven && r.truth.size() == 0) {
        drive(j, controlled);
      } else if (r.truth.size() > 0 && r.believed().size() > 0) {
        if (placed_.position.empty()) RAVENCAL_RETURN_IF_ERROR(predict_joints(positions));
        write_position(j, Role::kJointTruth, placed_.position[j], r.truth, "joint");
      } else if (r.desired.size() > 0 && r.estimate.size() > 0) {
        physics::JointSignals asked = signals(r.desired);
        asked.driven = asked_of_drive(j);
        RAVENCAL_ASSIGN_OR_RETURN(const VectorXd error,
                                  physics::joint_error(plant_.joints[j], asked));
        write_position(j, Role::kJointEstimate, r.desired + error, r.estimate,
                       "followed its desired position");
      }
    }
    if (!out_.joints.empty()) return std::move(out_);
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: no joint of {} can be simulated along it: record an effort or a desired "
                    "position with a measured one, or an estimate with a truth",
                    out_.recording.source, plant_.source)};
  }

 private:
  void mark_episodes() {
    fresh_.assign(static_cast<std::size_t>(t_s_.size()), 0);
    if (!fresh_.empty()) fresh_.front() = 1;
    for (const record::Event& event : out_.recording.events) {
      if (event.kind != "episode") continue;
      const auto at =
          std::lower_bound(out_.recording.t_ns.begin(), out_.recording.t_ns.end(), event.t_ns);
      if (at != out_.recording.t_ns.end())
        fresh_[static_cast<std::size_t>(at - out_.recording.t_ns.begin())] = 1;
    }
  }

  [[nodiscard]] VectorXd column(Role role, const std::string& joint) const {
    const auto index = out_.recording.column(role, joint);
    return index ? VectorXd(out_.recording.samples.col(*index)) : VectorXd();
  }

  [[nodiscard]] static double to_joint(const physics::Joint& joint) {
    return joint.reduction / joint.gearbox_ratio;
  }
  [[nodiscard]] static double per_input(const physics::Joint& joint) {
    const double counts = joint.drive.dac_counts_per_n_m;
    return (counts != 0.0 ? 1.0 / counts : joint.drive.gain) * to_joint(joint);
  }

  [[nodiscard]] Recorded signals_of(const physics::Joint& joint) const {
    Recorded r;
    r.estimate = column(Role::kJointEstimate, joint.name);
    r.motor = column(Role::kMotorPosition, joint.name) / joint.reduction;
    r.desired = column(Role::kDesiredPosition, joint.name);
    r.truth = column(Role::kJointTruth, joint.name);
    const bool torque = out_.recording.column(Role::kDriveTorque, joint.name).has_value();
    r.effort = torque ? VectorXd(column(Role::kDriveTorque, joint.name) * to_joint(joint))
                      : VectorXd(column(Role::kDriveInput, joint.name) * per_input(joint));
    return r;
  }

  /// The plant's servo at the joint; what clips its effort is the drive's saturation.
  [[nodiscard]] std::optional<physics::ServoLaw> law(std::size_t j) const {
    auto law = physics::servo_law(plant_.joints[j]);
    if (!law || law->position <= 0.0) return std::nullopt;
    law->limit = 0.0;
    return law;
  }

  /// Motor and link under effort; windows start from the recorded state.
  void drive(std::size_t j, bool controlled) {
    const physics::Joint& joint = plant_.joints[j];
    const Recorded& r = recorded_[j];
    const VectorXd velocity = velocity_of(r.measured());
    const VectorXd side =
        velocity.unaryExpr([](double v) { return v > 0.0 ? 1.0 : (v < 0.0 ? -1.0 : 0.0); });
    const physics::DriveSignals signals{t_s_,     r.measured(), velocity, side,
                                        r.effort, r.desired,    off_};
    physics::RunningDrive drive;
    drive.numbers = physics::drive_numbers(joint, physics::joint_inertia(plant_, j), kBristle_ji);
    drive.load = physics::pendulum_load(plant_).value_or(physics::DriveLoad{weights_[j]});
    drive.effort_limit = joint.parameter("saturation", "limit");
    if (controlled) drive.law = law(j);
    const Index rows = t_s_.size();
    const VectorXd none = VectorXd::Zero(rows);
    physics::DriveRun run{r.measured(), none, r.effort.size() > 0 ? r.effort : none};
    for (Index first = 0; first < rows;)
      first = physics::run_drive(drive, signals, first, end_of_window(first, controlled), run);
    // Without an effort beside it, how late the joint is seen is how late its motor is.
    if (const double late_s = joint.parameter("delay", "delay"); late_s != 0.0 && !r.effort.size())
      run.position = physics::later(t_s_, fresh_, run.position, late_s);
    // Nothing follows the last row: it keeps what was asked before.
    if (controlled && rows > 1) run.effort.tail(1) = run.effort.segment(rows - 2, 1);
    write_drive(j, run, controlled);
  }

  /// A window ends where an episode begins and, where no controller bounds the error, in time.
  [[nodiscard]] Index end_of_window(Index first, bool controlled) const {
    Index end = first + 1;
    while (end < t_s_.size() && fresh_[static_cast<std::size_t>(end)] == 0 &&
           (controlled || t_s_[end] - t_s_[first] < options_.restart_s))
      ++end;
    return end;
  }

  /// Over some samples to either side.
  [[nodiscard]] VectorXd velocity_of(const VectorXd& position) const {
    constexpr Index kReach = 5;
    VectorXd velocity = VectorXd::Zero(position.size());
    for (Index i = 0; i < position.size(); ++i) {
      const Index before = std::max<Index>(0, i - kReach);
      const Index after = std::min<Index>(position.size() - 1, i + kReach);
      const double dt_s = t_s_[after] - t_s_[before];
      if (dt_s > 0.0) velocity[i] = (position[after] - position[before]) / dt_s;
    }
    return velocity;
  }

  /// Where a status channel says that the drives were switched off.
  void find_power_channel() {
    for (std::size_t c = 0; c < out_.recording.channels.size(); ++c) {
      const record::Channel& channel = out_.recording.channels[c];
      if (channel.role != Role::kStatus || channel.name.find("torque_on") == std::string::npos)
        continue;
      off_.clear();
      for (const double on : out_.recording.samples.col(static_cast<Index>(c)))
        off_.push_back(on >= 0.5 ? 0 : 1);
    }
  }

  /// Measured loads from outside, joint by joint; empty where the plant has or the recording holds
  /// none.
  [[nodiscard]] std::vector<VectorXd> external_loads() const {
    std::vector<VectorXd> loads(plant_.joints.size());
    for (std::size_t j = 0; j < loads.size(); ++j) {
      const auto& load = plant_.joints[j].external_load;
      const auto at = load ? out_.recording.column(load->channel) : std::nullopt;
      if (at) loads[j] = out_.recording.samples.col(*at);
    }
    return loads;
  }

  void write_drive(std::size_t j, const physics::DriveRun& run, bool controlled) {
    const physics::Joint& joint = plant_.joints[j];
    const Recorded& r = recorded_[j];
    set(Role::kMotorPosition, joint.name, run.position * joint.reduction);
    set(Role::kMotorVelocity, joint.name, run.velocity * joint.reduction);
    if (r.estimate.size() > 0)
      set(Role::kJointEstimate, joint.name, r.estimate + run.position - r.measured());
    if (controlled) {
      set(Role::kDriveTorque, joint.name, run.effort / to_joint(joint));
      set(Role::kDriveInput, joint.name, run.effort / per_input(joint));
    }
    const std::string how =
        controlled
            ? "drive with its controller"
            : fmt::format("drive under recorded efforts, {:g} s at a time", options_.restart_s);
    report(joint.name, how, run.position - r.measured(), false);
  }

  [[nodiscard]] physics::JointSignals signals(const VectorXd& asked) const {
    return {t_s_, fresh_, asked, [this](const std::string& name) { return named(name); }, {}};
  }

  /// Where its drive has to be for the joint to be where it is desired: without what the plant's
  /// coupling adds.
  [[nodiscard]] VectorXd asked_of_drive(std::size_t j) const {
    VectorXd drive = recorded_[j].desired;
    for (std::size_t k = 0; k < j; ++k) {
      if (plant_.coupling[j][k] != 0.0 && recorded_[k].desired.size() > 0)
        drive -= plant_.coupling[j][k] * recorded_[k].desired;
    }
    return drive;
  }

  /// All joints with their motors forced in. Weights need every joint's position.
  core::Status predict_joints(const std::vector<VectorXd>& positions) {
    physics::Plant plant = plant_;
    physics::ForcedMotion forced{t_s_, fresh_, {}, external_loads(), {}};
    forced.load = [this](const std::string& name) { return named(name); };
    for (std::size_t j = 0; j < positions.size(); ++j) {
      const Recorded& r = recorded_[j];
      VectorXd motor = r.estimate.size() > 0 ? VectorXd() : r.motor;
      if (positions[j].size() == 0) plant.robot.gravity_m_per_s2 = {};
      if (motor.size() == 0) {
        motor = positions[j].size() > 0 ? positions[j] : VectorXd(VectorXd::Zero(t_s_.size()));
        for (std::size_t k = 0; k < j; ++k) {
          if (plant_.coupling[j][k] != 0.0 && positions[k].size() > 0)
            motor -= plant_.coupling[j][k] * positions[k];
        }
      }
      forced.motors.push_back(physics::smooth_motion(t_s_, motor, fresh_));
    }
    RAVENCAL_ASSIGN_OR_RETURN(placed_, physics::predict(plant, forced));
    return {};
  }

  void write_position(std::size_t j, Role role, VectorXd position, const VectorXd& measured,
                      const std::string& how) {
    const physics::Joint& joint = plant_.joints[j];
    // Values that were not measured, as of joints that are held, are not simulated either.
    for (Index i = 0; i < position.size(); ++i)
      if (!std::isfinite(measured[i])) position[i] = measured[i];
    set(role, joint.name, position);
    report(joint.name, how, position - measured,
           joint.parameter("homing_offset", "deviation") > 0.0);
  }

  /// A joint's position, or a recorded load of that name.
  [[nodiscard]] VectorXd named(const std::string& name) const {
    if (const auto joint = plant_.joint_index(name)) return recorded_[*joint].believed();
    const auto index = out_.recording.column(name);
    return index ? VectorXd(out_.recording.samples.col(*index)) : VectorXd();
  }

  void set(Role role, const std::string& joint, const VectorXd& values) {
    if (const auto index = out_.recording.column(role, joint))
      out_.recording.samples.col(*index) = values;
  }

  void report(const std::string& joint, const std::string& how, const VectorXd& error,
              bool homing_draws) {
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (const double e : error) {
      if (!std::isfinite(e)) continue;
      sum += e;
      squares += e * e;
      count += 1.0;
    }
    count = std::max(1.0, count);
    const double constant = homing_draws ? sum / count : 0.0;
    FollowedJoint followed{joint, how,
                           std::sqrt(std::max(0.0, squares / count - constant * constant))};
    if (homing_draws) followed.drawn_constant_ji = -constant;
    out_.joints.push_back(std::move(followed));
  }

  const physics::Plant& plant_;
  FollowOptions options_;
  FollowResult out_;
  VectorXd t_s_;
  std::vector<char> fresh_;
  std::vector<char> off_;  ///< 1 where the drives were off; empty: nowhere
  std::vector<Recorded> recorded_;
  std::vector<VectorXd> weights_;
  physics::Prediction placed_;
};

}  // namespace

core::Result<FollowResult> follow_recording(const physics::Plant& plant,
                                            const record::Recording& recording,
                                            const FollowOptions& options) {
  if (recording.rows() < 2) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: nothing to follow", recording.source)};
  }
  return Follower(plant, recording, options).run();
}

}  // namespace ravencal::simulation
