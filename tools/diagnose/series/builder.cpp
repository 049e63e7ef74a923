// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "diagnose/series/input.hpp"
#include "diagnose/series/operators.hpp"
#include "diagnose/series/posture.hpp"
#include "diagnose/series/rest.hpp"
#include "diagnose/series/series.hpp"
#include "diagnose/series/table.hpp"
#include "physics/plant_effort.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;
using record::Role;

/// Positions of every joint on each side of the transmission, where recorded.
struct Positions {
  VectorXd estimate;  ///< empty if unknown
  VectorXd motor;     ///< motor angle over reduction
  VectorXd desired;
  VectorXd truth;
  VectorXd effort;  ///< of the drive, at the joint
};

class Builder {
 public:
  Builder(const Table& table, const physics::Plant& plant) : table_(table), plant_(plant) {
    for (const physics::Joint& joint : plant.joints) positions_.push_back(positions_of(joint));
    derive_estimates();
  }

  SeriesSet build() {
    SeriesSet set;
    std::vector<VectorXd> believed, truth;
    for (const Positions& p : positions_) {
      believed.push_back(best_position(p));
      truth.push_back(p.estimate.size() > 0 ? p.truth : VectorXd());
    }
    const std::vector<VectorXd> posture = posture_of(believed, truth, table_.recording());
    weights_ = holding_efforts(plant_, posture);
    physics::add_external_loads(plant_, external_loads(), weights_);
    payloads_ = physics::payload_efforts_per_kg(plant_, posture);
    drive_weights_ = physics::motor_efforts(plant_, weights_);
    drive_payloads_ = physics::motor_efforts(plant_, payloads_);
    cable_weights_ = physics::cable_efforts(plant_, weights_);
    cable_payloads_ = physics::cable_efforts(plant_, payloads_);
    for (std::size_t j = 0; j < positions_.size(); ++j)
      frictions_.push_back(cable_friction(table_.t_s(),
                                          Table::bridged(best_position(positions_[j])),
                                          table_.fresh(), cable_numbers(plant_.joints[j])));
    drive_frictions_ = physics::motor_efforts(plant_, frictions_);
    for (std::size_t j = 0; j < positions_.size(); ++j) moving_.push_back(moving_effort(j));
    cable_moving_ = physics::cable_efforts(plant_, moving_);
    stretches_.resize(positions_.size());
    for (std::size_t j = 0; j < positions_.size(); ++j) add_joint(j, set);
    return set;
  }

 private:
  [[nodiscard]] VectorXd signal_or_empty(Role role, const std::string& joint) const {
    return table_.has(role, joint) ? table_.signal(role, joint) : VectorXd();
  }

  [[nodiscard]] Positions positions_of(const physics::Joint& joint) const {
    Positions p;
    p.estimate = signal_or_empty(Role::kJointEstimate, joint.name);
    p.motor = signal_or_empty(Role::kMotorPosition, joint.name);
    if (p.motor.size() > 0) p.motor /= joint.reduction;
    p.desired = signal_or_empty(Role::kDesiredPosition, joint.name);
    p.truth = signal_or_empty(Role::kJointTruth, joint.name);
    const double to_joint = joint.reduction / joint.gearbox_ratio;
    if (table_.has(Role::kDriveTorque, joint.name)) {
      p.effort = table_.signal(Role::kDriveTorque, joint.name) * to_joint;
    } else if (table_.has(Role::kDriveInput, joint.name)) {
      const double counts = joint.drive.dac_counts_per_n_m;
      const double gain = counts != 0.0 ? 1.0 / counts : joint.drive.gain;
      p.effort = table_.signal(Role::kDriveInput, joint.name) * gain * to_joint;
    }
    return p;
  }

  /// joint = motor / reduction + coupling * joints, in the plant's order.
  void derive_estimates() {
    for (std::size_t j = 0; j < positions_.size(); ++j) {
      Positions& p = positions_[j];
      if (p.estimate.size() > 0 || p.motor.size() == 0) continue;
      p.estimate = p.motor;
      for (std::size_t k = 0; k < j; ++k) {
        const double factor = plant_.coupling[j][k];
        if (factor != 0.0 && positions_[k].estimate.size() > 0) {
          p.estimate += factor * positions_[k].estimate;
        }
      }
    }
  }

  /// Measured loads from outside, joint by joint; empty where the plant has none.
  [[nodiscard]] std::vector<VectorXd> external_loads() const {
    std::vector<VectorXd> loads;
    for (const physics::Joint& joint : plant_.joints)
      loads.push_back(joint.external_load
                          ? Table::bridged(table_.signal(joint.external_load->channel))
                          : VectorXd());
    return loads;
  }

  static const VectorXd& best_position(const Positions& p) {
    if (p.estimate.size() > 0) return p.estimate;
    return p.truth.size() > 0 ? p.truth : p.desired;
  }

  /// Effort of the joint's link and of the friction behind its cable, position by position; empty
  /// where nothing says how it moves.
  [[nodiscard]] VectorXd moving_effort(std::size_t j) const {
    const VectorXd position = Table::bridged(best_position(positions_[j]));
    if (position.size() == 0) return {};
    const Motion motion =
        physics::smooth_motion(table_.t_s(), position, table_.fresh(), table_.held_out(), 2);
    return physics::link_inertia(plant_.joints[j]) * motion.a + frictions_[j];
  }

  void add_joint(std::size_t j, SeriesSet& set) {
    const Positions& p = positions_[j];
    const std::string& name = plant_.joints[j].name;
    const VectorXd& believed = p.estimate.size() > 0 ? p.estimate : p.desired;
    const bool transmission = p.truth.size() > 0 && believed.size() > 0;
    const bool drive = p.effort.size() > 0 && (p.motor.size() > 0 || believed.size() > 0);
    if (transmission)
      set.series.push_back(position_series(j, Stage::kTransmission, p.truth, believed));
    if (drive) set.series.push_back(drive_series(j));
    if (drive && p.desired.size() > 0 && plant_.joints[j].controller) {
      set.series.push_back(command_series(j));
    }
    const bool tracking = !transmission && !drive && p.desired.size() > 0 && p.estimate.size() > 0;
    if (tracking) set.series.push_back(position_series(j, Stage::kTracking, p.estimate, p.desired));
    if (!transmission && !drive && !tracking) {
      set.not_possible[name] = "the recording holds too few of this joint's positions and efforts";
    } else if (!transmission) {
      set.not_possible[name] =
          "no joint_truth was recorded, so nothing behind the motor can be seen";
    } else if (!drive) {
      set.not_possible[name] =
          "no drive effort was recorded, so friction and load of the drive cannot be seen";
    }
  }

  [[nodiscard]] Series basis(std::size_t j, Stage stage, const VectorXd& position) {
    const physics::Joint& joint = plant_.joints[j];
    Series series;
    series.joint = joint.name;
    series.stage = stage;
    series.prismatic = joint.kind == physics::JointKind::kPrismatic;
    series.t_s = table_.t_s();
    series.recording = table_.recording();
    series.fresh = table_.fresh();
    series.held_out = table_.held_out();
    series.inertia = joint_inertia(plant_, j);
    series.motion = physics::smooth_motion(series.t_s, position, series.fresh, series.held_out,
                                           stage == Stage::kDrive ? 2 : 1);
    series.nominal_mass_kg = joint.link.mass_kg;
    series.drive_order = joint.reduction / joint.gearbox_ratio;
    series.presliding = joint.parameter("presliding", "displacement");
    const bool drive = stage == Stage::kDrive || stage == Stage::kCommand;
    series.weight = drive ? drive_weights_[j] : cable_weights_[j];
    series.effort_recorded = positions_[j].effort.size() > 0;
    series.payload_per_kg = drive ? drive_payloads_[j] : cable_payloads_[j];
    const Positions& own = positions_[j];
    if (own.desired.size() > 0 && best_position(own).size() > 0)
      series.tracking_error = own.desired - best_position(own);
    for (std::size_t k = 0; k < positions_.size(); ++k) {
      const VectorXd& other =
          stage == Stage::kTracking ? positions_[k].desired : best_position(positions_[k]);
      if (k == j || other.size() == 0) continue;
      series.others.push_back(
          {plant_.joints[k].name,
           plant_.joints[k].kind == physics::JointKind::kPrismatic ? "m" : "rad",
           physics::smooth_motion(series.t_s, other, series.fresh, series.held_out, 1).q});
    }
    series.servo = physics::servo_law(joint);
    series.removable_mass_kg = plant_.joints.back().link.mass_kg + plant_.payload.mass_kg;
    series.cable = cable_numbers(joint);
    series.inertial = link_inertia(joint) * series.motion.a;
    if (stage == Stage::kDrive) wind(j, series);
    if (stage == Stage::kTransmission && cable_moving_[j].size() > 0)
      series.inertial += cable_moving_[j] - moving_[j];
    CableMotion cable = series.cable_motion();
    series.transmitted = std::move(cable.tension);
    if (!drive && !series.cable.rigid()) stretches_[j] = std::move(cable.stretch);
    for (const record::Channel& channel : table_.channels()) {
      // Efforts that belong to no joint of the plant (a sensor's, other motors') may load this one.
      const bool effort = channel.role == Role::kFeature && channel.joint.empty() &&
                          (channel.unit == "N" || channel.unit == "N_m");
      const bool load =
          channel.role == Role::kLoad && (channel.joint.empty() || channel.joint == joint.name);
      const bool in_weight = joint.external_load && joint.external_load->channel == channel.name;
      if (!in_weight && (load || (effort && stage == Stage::kTransmission))) {
        series.loads.push_back({channel.name, channel.unit, table_.signal(channel.name)});
      }
    }
    return series;
  }

  /// Cables over other joints' pulleys move this joint while its motor stands: friction behind the
  /// cable follows the joint, and other joints' loads their motors (see motor_efforts).
  void wind(std::size_t j, Series& series) const {
    const Positions& p = positions_[j];
    if (physics::coupled(plant_, j) && p.motor.size() > 0 && p.estimate.size() > 0)
      series.wound = Table::bridged(p.estimate);
    const VectorXd others = drive_frictions_[j] - frictions_[j];
    if (!others.isZero(0.0)) series.others_friction = others;
  }

  /// Where a status channel says that the drive was off, efforts are not what the drive did.
  void mask_unpowered(Series& series) const {
    for (const record::Channel& channel : table_.channels()) {
      if (channel.role != Role::kStatus || channel.name.find("torque_on") == std::string::npos)
        continue;
      const VectorXd on = table_.signal(channel.name);
      for (Index i = 0; i < series.rows(); ++i) {
        if (on[i] < 0.5) series.valid[static_cast<std::size_t>(i)] = 0;
      }
    }
  }

  /// Without the mean of each recording's valid rows: offsets are set at each homing, by joint.
  void centre(VectorXd& x) const {
    const auto& recording = table_.recording();
    std::map<int, std::pair<double, double>> sums;
    for (Index i = 0; i < x.size(); ++i) {
      if (!std::isfinite(x[i])) continue;
      auto& [sum, count] = sums[recording[static_cast<std::size_t>(i)]];
      sum += x[i];
      count += 1.0;
    }
    double last = 0.0;
    for (Index i = 0; i < x.size(); ++i) {
      if (std::isfinite(x[i])) {
        const auto& [sum, count] = sums[recording[static_cast<std::size_t>(i)]];
        last = x[i] - sum / count;
      }
      x[i] = last;
    }
  }

  /// `stretches_` of the joints before this one must be known.
  [[nodiscard]] std::vector<Inherited> inherited(std::size_t j) const {
    std::vector<Inherited> out;
    for (std::size_t k = 0; k < j; ++k) {
      const Positions& other = positions_[k];
      const double factor = plant_.coupling[j][k];
      if (factor == 0.0 || other.truth.size() == 0 || other.estimate.size() == 0) continue;
      const VectorXd stretch = stretches_[k].size() > 0 ? VectorXd(-factor * stretches_[k])
                                                        : VectorXd(VectorXd::Zero(table_.rows()));
      const VectorXd whole = factor * (other.truth - other.estimate);
      const double finite = std::max(1.0, whole.array().isFinite().cast<double>().sum());
      const double mean = whole.array().isFinite().select(whole.array(), 0.0).sum() / finite;
      Inherited part{plant_.joints[k].name,
                     plant_.joints[j].coupling_through,
                     factor,
                     stretch,
                     whole - stretch,
                     mean};
      centre(part.stretch);
      centre(part.rest);
      out.push_back(std::move(part));
    }
    return out;
  }

  /// What cables of joints behind this one may add to its own, where the plant does not say.
  [[nodiscard]] std::vector<Carried> carried(std::size_t j) const {
    std::vector<Carried> out;
    for (std::size_t k = j + 1; k < positions_.size(); ++k) {
      const double factor = physics::coupling_of(plant_, k, j);
      if (factor == 0.0 || plant_.joints[k].coupling_through || cable_moving_[k].size() == 0)
        continue;
      out.push_back({plant_.joints[k].name, factor * cable_weights_[k], factor * cable_payloads_[k],
                     factor * cable_moving_[k]});
    }
    return out;
  }

  /// The series' motion without what the plant's coupling adds to it.
  [[nodiscard]] VectorXd driven(const Series& series) const {
    VectorXd drive = series.motion.q;
    const auto& row = plant_.coupling[*plant_.joint_index(series.joint)];
    for (const Companion& other : series.others)
      drive -= row[*plant_.joint_index(other.name)] * other.value;
    return drive;
  }

  [[nodiscard]] Series position_series(std::size_t j, Stage stage, const VectorXd& measured,
                                       const VectorXd& believed) {
    Series series = basis(j, stage, believed);
    series.unit = series.prismatic ? "m" : "rad";
    series.y = measured - believed;
    if (stage == Stage::kTransmission) {
      series.inherited = inherited(j);
      series.carried = carried(j);
    }
    if (stage == Stage::kTracking) series.driven = driven(series);
    series.mark_valid();
    return series;
  }

  [[nodiscard]] Series drive_series(std::size_t j) {
    const Positions& p = positions_[j];
    Series series = basis(j, Stage::kDrive, p.motor.size() > 0 ? p.motor : best_position(p));
    series.unit = series.prismatic ? "N" : "N_m";
    series.recorded = p.effort;
    series.y = physics::filter_like_acceleration(series.t_s, p.effort, series.fresh,
                                                 std::max(series.motion.half_width_s, 1e-9));
    series.mark_valid();
    mask_unpowered(series);
    series.at_rest = rows_at_rest(series, p.desired);
    return series;
  }

  /// The control law works on motor angles; everything here is already divided by the reduction.
  [[nodiscard]] Series command_series(std::size_t j) {
    const Positions& p = positions_[j];
    const VectorXd& measured = best_position(p);  // desired joints are met by joints, not motors
    Series series = basis(j, Stage::kCommand, p.desired);
    series.unit = series.prismatic ? "N" : "N_m";
    series.y = p.effort;
    series.position_error = motor_error(j);
    series.desired_rate = series.motion.v;
    const auto recorded = signal_or_empty(Role::kMotorVelocity, series.joint);
    series.measured_rate = recorded.size() > 0 ? VectorXd(recorded / plant_.joints[j].reduction)
                                               : backward_rate(series.t_s, measured, series.fresh);
    series.mark_valid();
    mask_unpowered(series);
    return series;
  }

  /// Error that drives the joint's motor, without what other joints' motors are believed to add.
  [[nodiscard]] VectorXd motor_error(std::size_t j) const {
    VectorXd own = positions_[j].desired - best_position(positions_[j]);
    for (std::size_t k = 0; k < positions_.size(); ++k) {
      const Positions& p = positions_[k];
      if (k != j && p.desired.size() > 0 && best_position(p).size() > 0)
        own -= plant_.coupling[j][k] * Table::bridged(p.desired - best_position(p));
    }
    return own;
  }

  const Table& table_;
  const physics::Plant& plant_;
  std::vector<Positions> positions_;
  std::vector<VectorXd> weights_;        ///< at the joints
  std::vector<VectorXd> drive_weights_;  ///< at the motors
  std::vector<VectorXd> payloads_;       ///< per kg
  std::vector<VectorXd> drive_payloads_;
  std::vector<VectorXd> frictions_, drive_frictions_;  ///< behind the cables: at joints, at motors
  std::vector<VectorXd> moving_;                       ///< accelerations and those frictions
  /// As the cables carry them, those of cables over their links included.
  std::vector<VectorXd> cable_weights_, cable_payloads_, cable_moving_;
  std::vector<VectorXd> stretches_;  ///< of the plant's cables, once their transmission was built
};

}  // namespace

core::Result<SeriesSet> build_series(const std::vector<Recording>& training,
                                     const std::vector<Recording>& held_out,
                                     const physics::Plant& plant, const SeriesOptions& options) {
  RAVENCAL_RETURN_IF_ERROR(check_input(training, held_out, plant, options.held_out_from_s));
  const Table table(training, held_out, options);
  if (table.rows() < 50) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: {} samples are too few to diagnose; at least 50 are needed",
                                   training.front().source, table.rows())};
  }
  SeriesSet set = Builder(table, plant).build();
  if (set.series.empty()) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format(
            "{}: no joint of the plant {} has two signals to compare: joint_truth with "
            "joint_estimate or motor_position, drive_torque or drive_input with a position, "
            "or desired_position with a measured one; recorded: {} (`ravencal info {}` lists all)",
            training.front().source, plant.source, recorded_joints(training),
            training.front().source)};
  }
  set.notes = input_notes(training, held_out, options.held_out_from_s);
  for (std::string& note : series_notes(set, training, held_out, plant))
    set.notes.push_back(std::move(note));
  return set;
}

}  // namespace ravencal::diagnose
