// SPDX-License-Identifier: Apache-2.0
#include "physics/predict/predict.hpp"

#include <Eigen/LU>
#include <utility>

#include "physics/cable_replay.hpp"
#include "physics/drives.hpp"
#include "physics/effects/eccentricity.hpp"
#include "physics/effects/thermal_drift.hpp"
#include "physics/joint_error.hpp"
#include "physics/plant_effort.hpp"
#include "physics/predict/run_drive.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Weights depend on where the links are, and that on the weights: the second pass changes an
/// error of some degrees by a few per cent, a third one nothing that an encoder shows.
constexpr int kPasses = 2;

/// Steps of a drive that follows under its law: a tenth of the time constants of servos.
constexpr double kLoopStep_s = 4e-3;

/// Half of the rows over which the rate of an effort is taken: its lateness is less than a row.
constexpr Index kRateReach = 1;

/// Where a joint is when its motor counts zero.
VectorXd constants_of(const ForcedMotion& forced, const Plant& plant,
                      const DriveKinematics& kinematics) {
  return forced.homed ? homed_constants(plant, kinematics)
                      : VectorXd(VectorXd::Zero(kinematics.of_motor.rows()));
}

/// One plant along one forced motion.
class Step {
 public:
  Step(const Predictor& predictor, const Plant& plant,
       const std::vector<JointCircumstances>& circumstances, const std::vector<Motion>& links)
      : predictor_(predictor),
        forced_(predictor.forced()),
        believed_(predictor.believed()),
        plant_(plant),
        links_(links),
        circumstances_(circumstances) {
    std::vector<std::optional<double>> link_shares;
    for (const JointCircumstances& c : circumstances) link_shares.push_back(c.link_share);
    kinematics_ = drive_kinematics(plant, link_shares);
    homed_ = constants_of(forced_, plant, kinematics_);
    motor_zeros_ = kinematics_.of_motor.partialPivLu().solve(homed_);
  }

  [[nodiscard]] const DriveKinematics& kinematics() const { return kinematics_; }

  /// Tension and position of one joint; tensions of the joints after it must be known.
  void hang(std::size_t j, VectorXd load, Prediction& out) const {
    for (std::size_t k = j + 1; k < plant_.joints.size(); ++k) {
      if (const double factor = of_joint(k, j); factor != 0.0) load += factor * out.tension[k];
    }
    const VectorXd asked = asked_of(j);
    out.hanging[j] = asked - stretch_of(j, asked, load, out.tension[j]) +
                     shape_error(plant_.joints[j], signals(j));
  }

  [[nodiscard]] bool follows(std::size_t j) const {
    return !forced_.followed.empty() && forced_.followed[j].size() > 0;
  }

  /// What the encoder shows; joints before it and, of a motor that its law moves, after it must
  /// hang.
  void show(std::size_t j, Prediction& out) const {
    if (follows(j))
      show_followed(j, out);
    else
      show_hanging(j, out);
  }

  void ask(std::size_t j, Prediction& out) const {
    const Joint& joint = plant_.joints[j];
    const Motion& motor = forced_.motors[j];
    const DriveLosses losses = drive_losses(joint);
    const Eccentricity pulley(joint);
    VectorXd& effort = out.effort[j];
    effort = VectorXd::Zero(rows());
    for (std::size_t k = 0; k < plant_.joints.size(); ++k) {
      const double factor = kinematics_.of_motor(static_cast<Index>(k), static_cast<Index>(j));
      if (factor != 0.0) effort += factor * out.tension[k];
    }
    WanderingFriction friction;
    double held = 0.0;
    for (Index i = 0; i < rows(); ++i) {
      if (starts(i)) {
        friction = motor_friction(joint);
        held = 0.0;
      } else if (const double dt_s = forced_.t_s[i] - forced_.t_s[i - 1]; dt_s > 0.0) {
        held = friction.step((read(j, i) - read(j, i - 1)) / dt_s, dt_s, out.tension[j][i]);
      }
      const double at = motor_at(j, i);
      const double needed = losses.inertia * motor.a[i] + held + losses.drag(at, motor.v[i]) +
                            effort[i] + pulley.slope(at) * out.tension[j][i];
      effort[i] = needed / losses.effort_ratio + losses.lost_effort;
    }
    if (of(j).effort_lateness_s != 0.0) effort += of(j).effort_lateness_s * rate_of(effort);
  }

 private:
  void show_followed(std::size_t j, Prediction& out) const {
    const Joint& joint = plant_.joints[j];
    const JointCircumstances& c = of(j);
    VectorXd load = predictor_.link_load(plant_, j);
    for (std::size_t k = j + 1; k < plant_.joints.size(); ++k) {
      const double factor = kinematics_.of_motor(static_cast<Index>(k), static_cast<Index>(j));
      if (factor != 0.0) load += factor * out.tension[k];
    }
    const Motion& recorded = forced_.motors[j];
    RunningDrive drive;
    // What the link's inertia asks of the drive follows the motion that is simulated.
    const double link_inertia = predictor_.link_inertia(j);
    drive.numbers = drive_numbers(joint, drive_losses(joint).inertia + link_inertia,
                                  unstated_presliding(joint));
    drive.load.recorded = load - link_inertia * recorded.a;
    drive.effort_limit = joint.parameter("saturation", "limit");
    drive.law = servo_law(joint);
    drive.law->desired_rate = c.desired_rate * drive.law->rate;
    drive.longest_step_s = kLoopStep_s;
    const VectorXd none = VectorXd::Zero(rows());
    const DriveSignals signals{forced_.t_s, recorded.q,          recorded.v, none,
                               {},          forced_.followed[j], {}};
    DriveRun run{recorded.q, none, none};
    for (Index first = 0; first < rows();) {
      Index end = first + 1;
      while (end < rows() && !starts(end)) ++end;
      run_drive(drive, signals, first, end, run);
      first = end;
    }
    const double late_s = joint.parameter("delay", "delay") + c.truth_lateness_s;
    out.position[j] =
        late_s == 0.0 ? run.position : later(forced_.t_s, forced_.fresh, run.position, late_s);
  }

  void show_hanging(std::size_t j, Prediction& out) const {
    const JointCircumstances& c = of(j);
    VectorXd& position = out.position[j];
    position = out.hanging[j];
    for (std::size_t k = 0; k < plant_.joints.size(); ++k) {
      // Cables hung where the links were taken to be.
      if (const double factor = of_joint(j, k); factor != 0.0 && k != j)
        position += factor * (out.hanging[k] - links_[k].q);
    }
    if (const double late_s = forced_.truth_lateness_s + c.truth_lateness_s; late_s != 0.0)
      position = later(forced_.t_s, forced_.fresh, position, late_s);
    position.array() += c.encoder_offset;
    if (c.encoder_ramp == 0.0) return;
    const VectorXd& t_s = forced_.t_s;
    const double length_s = t_s[t_s.size() - 1] - t_s[0];
    position.array() += c.encoder_ramp * ((t_s.array() - t_s[0]) / length_s - 0.5);
  }

  [[nodiscard]] Index rows() const { return forced_.t_s.size(); }
  [[nodiscard]] double of_joint(std::size_t to, std::size_t from) const {
    return kinematics_.of_joint(static_cast<Index>(to), static_cast<Index>(from));
  }
  [[nodiscard]] bool starts(Index i) const {
    return i == 0 || forced_.fresh[static_cast<std::size_t>(i)] != 0;
  }
  [[nodiscard]] const JointCircumstances& of(std::size_t j) const {
    static const JointCircumstances none;
    return circumstances_.empty() ? none : circumstances_[j];
  }

  /// Where the motor is: counts that its encoder lost are no motion.
  [[nodiscard]] double read(std::size_t j, Index i) const {
    const Jump& lost = of(j).lost_counts;
    const double jumped = lost.size != 0.0 && forced_.t_s[i] >= lost.t_s ? lost.size : 0.0;
    return forced_.motors[j].q[i] - jumped;
  }

  /// Where the motor is by the joint's coordinates, not by what the controller took for them.
  [[nodiscard]] double motor_at(std::size_t j, Index i) const {
    return read(j, i) + motor_zeros_[static_cast<Index>(j)];
  }

  /// Position that the drive and the joints that the cable follows ask of the joint.
  [[nodiscard]] VectorXd asked_of(std::size_t j) const {
    VectorXd asked = VectorXd::Constant(rows(), homed_[static_cast<Index>(j)]);
    for (std::size_t k = 0; k < plant_.joints.size(); ++k) {
      const double of_motor = kinematics_.of_motor(static_cast<Index>(j), static_cast<Index>(k));
      if (of_motor != 0.0)
        for (Index i = 0; i < rows(); ++i) asked[i] += of_motor * read(k, i);
      if (of_joint(j, k) != 0.0) asked += of_joint(j, k) * links_[k].q;
    }
    const Joint& joint = plant_.joints[j];
    const Eccentricity pulley(joint);
    const double drift = joint.parameter("thermal_drift", "final");
    const double drift_time_s = joint.parameter("thermal_drift", "time");
    const Jump& slip = of(j).slip;
    for (Index i = 0; i < rows(); ++i) {
      asked[i] += pulley.at(motor_at(j, i)) +
                  thermal_drift(drift, drift_time_s, forced_.t_s[i] - forced_.t_s[0]);
      if (slip.size != 0.0 && forced_.t_s[i] >= slip.t_s) asked[i] += slip.size;
    }
    return asked;
  }

  /// What the joint lacks of what is asked, and the tension on the way.
  [[nodiscard]] VectorXd stretch_of(std::size_t j, const VectorXd& asked, const VectorXd& load,
                                    VectorXd& tension) const {
    CableNumbers numbers = cable_numbers(plant_.joints[j]);
    numbers.creep_start = of(j).creep_start;
    tension.resize(rows());
    VectorXd stretch(rows());
    CableReplay cable(numbers);
    for (Index i = 0; i < rows(); ++i) {
      if (starts(i)) {
        cable.start(asked[i], load[i]);
        stretch[i] = cable.offset(asked[i]);
      } else {
        stretch[i] = cable.step(asked[i], load[i], forced_.t_s[i] - forced_.t_s[i - 1]);
      }
      tension[i] = cable.tension();
    }
    // Nothing presses an unloaded joint against a side of its gap but what it leaves behind.
    const bool free = numbers.friction_level <= 0.0 && load.cwiseAbs().maxCoeff() <= 0.0;
    return free && numbers.gap_half_width > 0.0
               ? VectorXd(-play_error(plant_.joints[j], signals(j)))
               : stretch;
  }

  [[nodiscard]] VectorXd rate_of(const VectorXd& effort) const {
    VectorXd rate = VectorXd::Zero(rows());
    for (Index i = kRateReach; i + kRateReach < rows(); ++i) {
      const double dt_s = forced_.t_s[i + kRateReach] - forced_.t_s[i - kRateReach];
      if (dt_s > 0.0) rate[i] = (effort[i + kRateReach] - effort[i - kRateReach]) / dt_s;
    }
    return rate;
  }

  [[nodiscard]] JointSignals signals(std::size_t j) const {
    return {forced_.t_s, forced_.fresh, believed_[j], [this](const std::string& name) {
              if (const auto joint = plant_.joint_index(name)) return believed_[*joint];
              return forced_.load ? forced_.load(name) : VectorXd();
            }};
  }

  const Predictor& predictor_;
  const ForcedMotion& forced_;
  const std::vector<VectorXd>& believed_;
  const Plant& plant_;
  const std::vector<Motion>& links_;
  const std::vector<JointCircumstances>& circumstances_;
  DriveKinematics kinematics_;
  VectorXd homed_;
  VectorXd motor_zeros_;  ///< of_motor times it is homed_
};

}  // namespace

Predictor::Predictor(const Plant& plant, ForcedMotion forced, Masses masses)
    : forced_(std::move(forced)), loads_(plant, masses) {
  const auto joints = static_cast<Index>(plant.joints.size());
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    believed_.push_back(forced_.motors[j].q);
    for (std::size_t k = 0; k < j; ++k)
      if (plant.coupling[j][k] != 0.0) believed_[j] += plant.coupling[j][k] * believed_[k];
  }
  const DriveKinematics kinematics = drive_kinematics(plant);
  const MatrixXd carried = (MatrixXd::Identity(joints, joints) - kinematics.of_joint).inverse();
  const MatrixXd through = carried * kinematics.of_motor;
  const VectorXd homed = carried * constants_of(forced_, plant, kinematics);
  for (std::size_t j = 0; j < forced_.followed.size(); ++j)
    link_inertias_.push_back(forced_.followed[j].size() > 0 ? physics::link_inertia(plant, j)
                                                            : 0.0);
  links_.resize(plant.joints.size());
  for (Index j = 0; j < joints; ++j) {
    Motion& link = links_[static_cast<std::size_t>(j)];
    link.v = link.a = VectorXd::Zero(forced_.t_s.size());
    link.q = VectorXd::Constant(forced_.t_s.size(), homed[j]);
    for (Index k = 0; k < joints; ++k) {
      const Motion& motor = forced_.motors[static_cast<std::size_t>(k)];
      if (through(j, k) == 0.0) continue;
      link.q += through(j, k) * motor.q;
      link.v += through(j, k) * motor.v;
      link.a += through(j, k) * motor.a;
    }
  }
  loads_.move(links_);
}

void Predictor::move_links(const std::vector<VectorXd>& positions) {
  for (std::size_t j = 0; j < links_.size(); ++j) links_[j].q = positions[j];
  loads_.move(links_);
}

VectorXd Predictor::link_load(const Plant& plant, std::size_t joint) const {
  VectorXd load = loads_.of(plant, joint);
  if (!forced_.external_loads.empty())
    add_external_load(plant.joints[joint], forced_.external_loads[joint], load);
  return load;
}

Prediction Predictor::predict(const Plant& plant,
                              const std::vector<JointCircumstances>& circumstances) const {
  Prediction out;
  for (auto* part : {&out.effort, &out.position, &out.tension, &out.hanging})
    part->resize(plant.joints.size());
  update(plant, circumstances, 0, Reach::kEverything, out);
  return out;
}

void Predictor::update(const Plant& plant, const std::vector<JointCircumstances>& circumstances,
                       std::size_t joint, Reach reach, Prediction& out) const {
  const Step step(*this, plant, circumstances, links_);
  const DriveKinematics& kinematics = step.kinematics();
  const std::size_t joints = plant.joints.size();
  const bool everything = reach == Reach::kEverything;
  if (reach == Reach::kPosition) return step.show(joint, out);
  if (reach == Reach::kDrive) {
    step.ask(joint, out);
    if (step.follows(joint)) step.show(joint, out);
    return;
  }
  std::vector<char> hung(joints, everything ? 1 : 0);
  for (std::size_t j = joints; j-- > 0;) {
    hung[j] |= j == joint || (reach == Reach::kLinkLoad && carries(plant, j, joint)) ? 1 : 0;
    for (std::size_t k = j + 1; k < joints; ++k)
      hung[j] |=
          hung[k] != 0 && kinematics.of_joint(static_cast<Index>(k), static_cast<Index>(j)) != 0.0;
    if (hung[j] != 0) step.hang(j, link_load(plant, j), out);
  }
  for (std::size_t j = 0; j < joints; ++j) {
    bool pulled = hung[j] != 0;
    bool carried = hung[j] != 0;
    for (std::size_t k = 0; k < joints; ++k) {
      const auto row = static_cast<Index>(k);
      const auto column = static_cast<Index>(j);
      pulled = pulled || (hung[k] != 0 && kinematics.of_motor(row, column) != 0.0);
      carried = carried || (hung[k] != 0 && kinematics.of_joint(column, row) != 0.0);
    }
    if (pulled) step.ask(j, out);
    if (step.follows(j) ? pulled : carried) step.show(j, out);
  }
}

core::Result<Prediction> predict(const Plant& plant, const ForcedMotion& forced) {
  const auto recorded = [&](const std::string& name) {
    return plant.joint_index(name) || (forced.load && forced.load(name).size() > 0);
  };
  for (const Joint& joint : plant.joints) RAVENCAL_RETURN_IF_ERROR(check_signals(joint, recorded));
  Predictor predictor(plant, forced, Masses::kFixed);
  Prediction prediction = predictor.predict(plant);
  for (int pass = 1; pass < kPasses; ++pass) {
    predictor.move_links(prediction.hanging);
    prediction = predictor.predict(plant);
  }
  return prediction;
}

}  // namespace ravencal::physics
