// SPDX-License-Identifier: Apache-2.0
//
// Unscented Kalman filter of an elastic transmission: Haghighipanah, Li, Miyasaka, Hannaford,
// "Improving position precision of a servo-controlled elastic cable driven surgical robot using
// unscented Kalman filter", IROS 2015. Two masses and a spring per joint; the filter sees the
// motor's position and the drive's effort and estimates the joint behind the cable. Theirs couples
// three joints through the arm's full dynamics; here each joint is its own, with its weight as sine
// and cosine of its position, so that every recording with these channels can be used. Parameters
// that they took from drawings are fitted to the training truth (Ceres), and a constant offset is
// added.
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "methods/method.hpp"

namespace ravencal::methods {
namespace {

constexpr int kStates = 4;         ///< motor position and velocity, joint position and velocity
constexpr double kStepS = 1e-3;    ///< of the integration
constexpr double kMostGapS = 0.5;  ///< a longer gap between rows starts the filter anew
constexpr Eigen::Index kFitRows = 3000;

using State = Eigen::Matrix<double, kStates, 1>;
using Covariance = Eigen::Matrix<double, kStates, kStates>;

/// Everything per unit of the joint's inertia: accelerations.
struct Plant {
  double frequency = 40.0;    ///< of the joint on its cable, motor held: rad/s
  double damping = 0.1;       ///< ratio
  double joint_friction = 0;  ///< acceleration
  double weight_constant = 0, weight_sine = 0, weight_cosine = 0;
  double inertia_ratio = 0.2;   ///< joint's over motor's
  double effort_gain = 0.0;     ///< acceleration of the motor per recorded effort
  double offset = 0.0;          ///< of the estimate
  double rest_velocity = 1e-3;  ///< over which friction turns
};
constexpr int kParameters = 9;

Plant plant_of(const double* p, double rest_velocity) {
  Plant plant;
  plant.frequency = std::exp(p[0]);
  plant.damping = std::exp(p[1]);
  plant.joint_friction = p[2] * plant.frequency * plant.frequency;
  plant.weight_constant = p[3] * plant.frequency * plant.frequency;
  plant.weight_sine = p[4] * plant.frequency * plant.frequency;
  plant.weight_cosine = p[5] * plant.frequency * plant.frequency;
  plant.inertia_ratio = std::exp(p[6]);
  plant.effort_gain = p[7];
  plant.offset = p[8];
  plant.rest_velocity = rest_velocity;
  return plant;
}

/// Semi-implicit Euler over one row.
State propagate(const Plant& p, State x, double effort, double dt_s) {
  const int steps = std::max(1, static_cast<int>(std::lround(dt_s / kStepS)));
  const double h = dt_s / steps;
  const double w = p.frequency;
  for (int i = 0; i < steps; ++i) {
    const double pull = w * w * (x[0] - x[2]) + 2.0 * p.damping * w * (x[1] - x[3]);
    x[1] += h * (p.effort_gain * effort - p.inertia_ratio * pull);
    x[3] += h * (pull - p.joint_friction * std::tanh(x[3] / p.rest_velocity) - p.weight_constant -
                 p.weight_sine * std::sin(x[2]) - p.weight_cosine * std::cos(x[2]));
    x[0] += h * x[1];
    x[2] += h * x[3];
  }
  return x;
}

struct Noise {
  double motor_acceleration = 1.0;  ///< standard deviation of what the model lacks, per second^2
  double joint_acceleration = 0.1;
  double measurement = 1e-4;  ///< of the motor's position
};

/// Julier and Uhlmann 1997, symmetric points, weight 1/5 at the centre.
class Filter {
 public:
  Filter(const Plant& plant, const Noise& noise) : plant_(plant), noise_(noise) {}

  void start(double motor) {
    // The cable carries the weight from the start.
    const double w2 = plant_.frequency * plant_.frequency;
    const double sag = (plant_.weight_constant + plant_.weight_sine * std::sin(motor) +
                        plant_.weight_cosine * std::cos(motor)) /
                       w2;
    x_ << motor, 0.0, motor - sag, 0.0;
    p_ = Covariance::Identity() * (noise_.measurement * noise_.measurement * 100.0);
  }

  void step(double motor, double effort, double dt_s) {
    constexpr double kSpread = 1.0;
    const Covariance root = ((kStates + kSpread) * p_).llt().matrixL();
    std::array<State, 2 * kStates + 1> points;
    points[0] = propagate(plant_, x_, effort, dt_s);
    for (int i = 0; i < kStates; ++i) {
      points[static_cast<std::size_t>(1 + i)] = propagate(plant_, x_ + root.col(i), effort, dt_s);
      points[static_cast<std::size_t>(1 + kStates + i)] =
          propagate(plant_, x_ - root.col(i), effort, dt_s);
    }
    const auto weight = [](std::size_t i) {
      return i == 0 ? kSpread / (kStates + kSpread) : 0.5 / (kStates + kSpread);
    };
    x_.setZero();
    for (std::size_t i = 0; i < points.size(); ++i) x_ += weight(i) * points[i];
    p_.setZero();
    for (std::size_t i = 0; i < points.size(); ++i)
      p_ += weight(i) * (points[i] - x_) * (points[i] - x_).transpose();
    const double motor_noise = noise_.motor_acceleration * dt_s;
    const double joint_noise = noise_.joint_acceleration * dt_s;
    p_(0, 0) += 0.25 * motor_noise * motor_noise * dt_s * dt_s;
    p_(1, 1) += motor_noise * motor_noise;
    p_(2, 2) += 0.25 * joint_noise * joint_noise * dt_s * dt_s;
    p_(3, 3) += joint_noise * joint_noise;
    // The measurement is a state: the update is the linear one.
    const State gain = p_.col(0) / (p_(0, 0) + noise_.measurement * noise_.measurement);
    x_ += gain * (motor - x_[0]);
    p_ -= gain * p_.row(0);
    p_ = 0.5 * (p_ + p_.transpose()).eval() +
         Covariance::Identity() * (1e-6 * noise_.measurement * noise_.measurement);
    if (!x_.allFinite() || !p_.allFinite()) start(motor);
  }

  /// JointFilter minus motor, and the offset.
  [[nodiscard]] double correction(double motor) const { return x_[2] - motor + plant_.offset; }

 private:
  Plant plant_;
  Noise noise_;
  State x_ = State::Zero();
  Covariance p_ = Covariance::Identity();
};

/// Measurements of one output, in order; a negative dt starts the filter anew.
struct Drive {
  std::vector<double> motor, effort, dt_s, error;
};

Drive drive_of(std::span<const Series> train, Eigen::Index output, Eigen::Index most_rows) {
  Drive d;
  double last_s = 0.0;
  for (const Series& s : train) {
    bool fresh = true;
    for (Eigen::Index row = 0;
         row < s.rows() && static_cast<Eigen::Index>(d.motor.size()) < most_rows; ++row) {
      const double motor = s.estimate(row, output);
      if (!std::isfinite(motor)) continue;
      const double dt = s.t_s[row] - last_s;
      last_s = s.t_s[row];
      fresh = fresh || s.fresh[static_cast<std::size_t>(row)] != 0 || dt > kMostGapS || dt <= 0.0;
      d.motor.push_back(motor);
      d.effort.push_back(std::isfinite(s.effort(row, output)) ? s.effort(row, output) : 0.0);
      d.dt_s.push_back(fresh ? -1.0 : dt);
      d.error.push_back(s.errors(row, output));
      fresh = false;
    }
  }
  return d;
}

/// How fast the motor's velocity changes: what the constant-effort model cannot follow.
Noise noise_of(const Drive& d) {
  double squares = 0.0;
  double count = 1e-9;
  for (std::size_t i = 2; i < d.motor.size(); ++i) {
    if (d.dt_s[i] <= 0.0 || d.dt_s[i - 1] <= 0.0) continue;
    const double a = ((d.motor[i] - d.motor[i - 1]) / d.dt_s[i] -
                      (d.motor[i - 1] - d.motor[i - 2]) / d.dt_s[i - 1]) /
                     d.dt_s[i];
    squares += a * a;
    count += 1.0;
  }
  const double acceleration = std::max(1e-6, std::sqrt(squares / count));
  return {acceleration, 0.1 * acceleration, 1e-5 + 1e-4 * acceleration * 0.01};
}

double typical_speed(const Drive& d) {
  double sum = 0.0;
  double count = 1e-9;
  for (std::size_t i = 1; i < d.motor.size(); ++i) {
    if (d.dt_s[i] <= 0.0) continue;
    sum += std::abs(d.motor[i] - d.motor[i - 1]) / d.dt_s[i];
    count += 1.0;
  }
  return std::max(1e-6, sum / count);
}

struct LikelihoodCost {
  const Drive* drive;
  Noise noise;
  double rest_velocity;
  double scale;
  bool operator()(double const* const* parameters, double* residuals) const {
    Filter filter(plant_of(parameters[0], rest_velocity), noise);
    const Drive& d = *drive;
    for (std::size_t i = 0; i < d.motor.size(); ++i) {
      if (d.dt_s[i] < 0.0)
        filter.start(d.motor[i]);
      else
        filter.step(d.motor[i], d.effort[i], d.dt_s[i]);
      residuals[i] =
          std::isfinite(d.error[i]) ? scale * (d.error[i] - filter.correction(d.motor[i])) : 0.0;
    }
    return true;
  }
};

struct JointFilter {
  Plant plant;
  Noise noise;
};

JointFilter fit_joint(const Drive& d) {
  double mean = 0.0;
  double square = 0.0;
  double count = 1e-9;
  for (const double e : d.error) {
    if (!std::isfinite(e)) continue;
    mean += e;
    square += e * e;
    count += 1.0;
  }
  mean /= count;
  const double deviation = std::sqrt(std::max(1e-18, square / count - mean * mean));
  const double rest = 0.1 * typical_speed(d);
  JointFilter joint{{}, noise_of(d)};
  std::array<double, kParameters> p = {
      std::log(40.0), std::log(0.2), 0.3 * deviation, 0.0, 0.0, 0.0, std::log(0.2), 0.0, mean};
  ceres::Problem problem;
  auto* cost = new ceres::DynamicNumericDiffCostFunction<LikelihoodCost>(
      new LikelihoodCost{&d, joint.noise, rest, 1.0 / (deviation * std::sqrt(count))});
  cost->AddParameterBlock(kParameters);
  cost->SetNumResiduals(static_cast<int>(d.motor.size()));
  problem.AddResidualBlock(cost, nullptr, p.data());
  constexpr std::array<double, 2> kFrequency = {5.0, 300.0};
  problem.SetParameterLowerBound(p.data(), 0, std::log(kFrequency[0]));
  problem.SetParameterUpperBound(p.data(), 0, std::log(kFrequency[1]));
  problem.SetParameterLowerBound(p.data(), 1, std::log(0.02));
  problem.SetParameterUpperBound(p.data(), 1, std::log(2.0));
  problem.SetParameterLowerBound(p.data(), 6, std::log(0.005));
  problem.SetParameterUpperBound(p.data(), 6, std::log(5.0));
  ceres::Solver::Options options;
  options.max_num_iterations = 12;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  joint.plant = plant_of(p.data(), rest);
  return joint;
}

class KalmanPredictor final : public Predictor {
 public:
  explicit KalmanPredictor(std::vector<JointFilter> joints) : joints_(std::move(joints)) {
    for (const JointFilter& joint : joints_) filters_.emplace_back(joint.plant, joint.noise);
  }
  void start(const Series&, Eigen::Index) override { fresh_ = true; }
  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    const double dt_s = series.t_s[row] - last_s_;
    last_s_ = series.t_s[row];
    const bool anew = fresh_ || dt_s <= 0.0 || dt_s > kMostGapS;
    fresh_ = false;
    for (std::size_t k = 0; k < filters_.size(); ++k) {
      const auto output = static_cast<Eigen::Index>(k);
      const double motor = series.estimate(row, output);
      const double effort = series.effort(row, output);
      if (!std::isfinite(motor)) {
        correction[output] = motor;
        fresh_ = true;
        continue;
      }
      if (anew)
        filters_[k].start(motor);
      else
        filters_[k].step(motor, std::isfinite(effort) ? effort : 0.0, dt_s);
      correction[output] = filters_[k].correction(motor);
    }
  }
  [[nodiscard]] std::size_t parameters() const override { return kParameters * joints_.size(); }
  [[nodiscard]] std::string remark() const override {
    std::string text = "joint on its cable:";
    for (const JointFilter& joint : joints_)
      text += fmt::format(" {:.0f} rad/s", joint.plant.frequency);
    return text + ", fitted to " + fmt::format("{} rows", kFitRows) + " at most";
  }

 private:
  std::vector<JointFilter> joints_;
  std::vector<Filter> filters_;
  double last_s_ = 0.0;
  bool fresh_ = true;
};

class Kalman final : public Method {
 public:
  std::string_view id() const override { return "ukf"; }
  std::string_view title() const override { return "UKF, elastic cable"; }
  std::string_view source() const override { return "Haghighipanah et al., IROS 2015"; }
  std::string why_not_loadable() const override { return "convert has no filters"; }
  std::string unsuited(const Problem& problem, std::span<const Series>,
                       const Settings&) const override {
    if (problem.order == Order::kTime) return "";
    return fmt::format("needs the motion itself; rows are {:g} s apart, more than {:g} s",
                       problem.row_period_s, kDynamicsPeriodS);
  }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    std::vector<JointFilter> joints;
    for (std::size_t k = 0; k < problem.outputs.size(); ++k) {
      if (!settings.keep_going(static_cast<double>(k) /
                               static_cast<double>(problem.outputs.size())))
        return stopped();
      const Drive drive = drive_of(train, static_cast<Eigen::Index>(k), kFitRows);
      const auto known = std::count_if(drive.error.begin(), drive.error.end(),
                                       [](double e) { return std::isfinite(e); });
      if (known < 100)
        return core::Error{core::ErrorCode::kData,
                           "fewer than 100 rows with truth to fit the filter to"};
      joints.push_back(fit_joint(drive));
    }
    return std::unique_ptr<Predictor>(std::make_unique<KalmanPredictor>(std::move(joints)));
  }
};

}  // namespace

std::unique_ptr<Method> make_kalman() { return std::make_unique<Kalman>(); }

}  // namespace ravencal::methods
