// SPDX-License-Identifier: Apache-2.0
#include "loop/margins.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include "core/catalogue.hpp"
#include "core/constants.hpp"
#include "core/joint_layout.hpp"
#include "model/hook_view.hpp"
#include "model/jacobian.hpp"
#include "model/mean_gain.hpp"

namespace ravencal::loop {
namespace {

using Eigen::Index;
using Eigen::Matrix3cd;
using Loci = std::array<Complex, 3>;

constexpr double kPi = std::numbers::pi;

/// An input that answers: which value it is, how long ago, and the column of its derivatives.
struct Input {
  core::RavenField field;
  std::size_t element;
  int lag_cycles;
  double mean_gain;  ///< of a cycle; 1 if it is no mean over time
  bool signless;     ///< a mean of the absolute value
  Index column;
};

std::vector<Input> inputs_of(const model::CalibrationModel& model, double cycle_s) {
  std::vector<Input> inputs;
  for (std::size_t i = 0; i < model.features.size(); ++i) {
    const model::FeatureSpec& feature = model.features[i];
    if (answer_of(feature.channel) != Answer::kModelled) continue;
    const core::CatalogueEntry& entry =
        core::catalogue()[*core::catalogue_index_of(feature.channel)];
    const double lag_s = feature.lag_rows * model.row_period_s;
    const double gain = model::is_mean(feature.transform)
                            ? static_cast<double>(model::mean_gain(
                                  cycle_s, static_cast<double>(feature.time_constant_s)))
                            : 1.0;
    const bool signless = feature.transform == model::Transform::kMeanOfAbs ||
                          feature.transform == model::Transform::kTravelMeanOfAbs;
    // The step of a mean over travel depends on the speed: it is taken to follow its channel at
    // once, which is the most that it can do.
    inputs.push_back({entry.field, entry.element, static_cast<int>(std::lround(lag_s / cycle_s)),
                      gain, signless, static_cast<Index>(i)});
  }
  return inputs;
}

/// Row of L, by output; joints that the model does not correct are -1.
std::vector<Index> joints_of(const model::CalibrationModel& model) {
  std::vector<Index> joints;
  for (const model::OutputSpec& output : model.outputs) {
    const auto end = core::kSlotNames.begin() + core::kCalibratedJointCount;
    const auto name = std::find(core::kSlotNames.begin(), end, output.joint);
    joints.push_back(name == end ? -1 : name - core::kSlotNames.begin());
  }
  return joints;
}

/// Follows the eigenvalues of one row from frequency to frequency and keeps the worst of all rows.
class Tracker {
 public:
  explicit Tracker(Margins& worst) : worst_(worst) {}

  void begin(Index row, const Loci& at_dc) {
    row_ = row;
    before_ = at_dc;
    before_hz_ = 0.0;
    take_real(at_dc, 0.0);
  }

  void next(Loci loci, double hz) {
    match(loci);
    for (std::size_t i = 0; i < loci.size(); ++i) {
      take_crossing(before_[i], loci[i], hz);
      take_size_one(before_[i], loci[i], hz);
    }
    before_ = loci;
    before_hz_ = hz;
  }

  /// At half the control rate L is real again.
  void end() { take_real(before_, before_hz_); }

 private:
  /// Orders the eigenvalues as those of the frequency before: the closest of the six ways.
  void match(Loci& loci) const {
    std::array<std::size_t, 3> order = {0, 1, 2};
    std::array<std::size_t, 3> best = order;
    double least = std::numeric_limits<double>::infinity();
    do {
      double distance = 0.0;
      for (std::size_t i = 0; i < 3; ++i) distance += std::abs(loci[order[i]] - before_[i]);
      if (distance < least) {
        least = distance;
        best = order;
      }
    } while (std::next_permutation(order.begin(), order.end()));
    loci = {loci[best[0]], loci[best[1]], loci[best[2]]};
  }

  void take_gain(double crossing, double hz) {
    if (!(crossing > 0.0) || 1.0 / crossing >= worst_.gain.value) return;
    worst_.gain = {1.0 / crossing, hz, row_};
  }

  void take_real(const Loci& loci, double hz) {
    constexpr double kRealShare = 1e-6;  // rounding of an eigenvalue of a real matrix
    for (const Complex& locus : loci) {
      if (std::abs(locus.imag()) <= kRealShare * std::abs(locus)) take_gain(locus.real(), hz);
    }
  }

  void take_crossing(const Complex& from, const Complex& to, double hz) {
    if ((from.imag() > 0.0) == (to.imag() > 0.0)) return;
    const double share = from.imag() / (from.imag() - to.imag());
    if (!std::isfinite(share)) return;
    take_gain(from.real() + share * (to.real() - from.real()), between(hz, share));
  }

  void take_size_one(const Complex& from, const Complex& to, double hz) {
    const double a = std::abs(from);
    const double b = std::abs(to);
    if ((a >= 1.0) == (b >= 1.0)) return;
    const double share = (1.0 - a) / (b - a);
    const double angle = std::abs(std::arg(from + share * (to - from)));
    if (angle < worst_.phase_rad.value) worst_.phase_rad = {angle, between(hz, share), row_};
  }

  [[nodiscard]] double between(double hz, double share) const {
    return before_hz_ + share * (hz - before_hz_);
  }

  Margins& worst_;
  Index row_ = 0;
  Loci before_{};
  double before_hz_ = 0.0;
};

Loci eigenvalues(const Matrix3cd& loop) {
  const Eigen::Vector3cd values = Eigen::ComplexEigenSolver<Matrix3cd>(loop, false).eigenvalues();
  return {values[0], values[1], values[2]};
}

/// What the input makes of its channel; `side`: the sign of channels of which only the size counts.
Complex transform_of(const Input& input, double side, Complex z) {
  const Complex mean = input.mean_gain / (1.0 - (1.0 - input.mean_gain) / z);
  return std::pow(z, -input.lag_cycles) * mean * (input.signless ? side : 1.0);
}

/// L at the servo's present frequency.
Matrix3cd loop_transfer(const std::vector<Input>& inputs, const std::vector<Index>& joints,
                        const Eigen::MatrixXd& slopes, const ServoLoop& servo, double side,
                        Complex z) {
  Matrix3cd loop = Matrix3cd::Zero();
  for (const Input& input : inputs) {
    const Response response = transform_of(input, side, z) * servo.of(input.field, input.element);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      if (joints[k] < 0) continue;
      loop.row(joints[k]) += slopes(static_cast<Index>(k), input.column) * response;
    }
  }
  return loop;
}

/// Shows the tracker the loci of one row at every frequency of the grid.
template <typename LociAt>
void follow(Tracker& tracker, ServoLoop& servo, Index row, const LociAt& loci_at) {
  const double cycle_s = servo.cycle_s();
  const double top_hz = 0.5 / cycle_s;
  servo.set_frequency(1.0, true);
  tracker.begin(row, loci_at(1.0));
  for (int i = 1; i <= kFrequencies; ++i) {
    const double hz =
        kLowestHz * std::pow(top_hz / kLowestHz, static_cast<double>(i - 1) / (kFrequencies - 1));
    const Complex z = i == kFrequencies ? Complex(-1.0) : std::polar(1.0, 2.0 * kPi * hz * cycle_s);
    servo.set_frequency(z);
    tracker.next(loci_at(z), hz);
  }
  tracker.end();
}

std::vector<std::string> unmodelled(const model::CalibrationModel& model) {
  std::set<std::string> names;
  for (const model::FeatureSpec& feature : model.features) {
    if (answer_of(feature.channel) == Answer::kUnknown) names.insert(feature.channel);
  }
  return {names.begin(), names.end()};
}

std::string describe(const Worst& worst, std::string_view what, double value, std::string_view unit,
                     double least) {
  std::string text = fmt::format("{}: {:.3g}{} (at least {:g})", what, value, unit, least);
  if (worst.row >= 0) {
    text += fmt::format(", at {:.3g} Hz in operating point {}", worst.frequency_hz, worst.row + 1);
  }
  return text + "\n";
}

/// Of the plant's controller, else of the model's.
ServoOptions servo_options(const physics::Plant& plant, const model::CalibrationModel& model) {
  const physics::ControllerBranch* branch = &plant.robot.controller;
  if (branch->name.empty()) branch = physics::find_controller_branch(model.origin.controller);
  ServoOptions options;
  if (branch == nullptr) return options;
  options.coupled_joint_velocity = branch->couples_velocities;
  options.encoder_age_cycles = branch->reads_encoders_before_sleep ? 1 : 0;
  return options;
}

}  // namespace

core::Result<OperatingPoints> operating_points(
    const model::CalibrationModel& model, std::span<const record::Recording* const> recordings) {
  Eigen::Index total = 0;
  for (const record::Recording* recording : recordings) total += recording->rows();
  // Rows are drawn before they are made: a play or lag needs the whole recording, a row little.
  const Index stride = std::max<Index>(1, (total + kRows - 1) / kRows);
  OperatingPoints points;
  points.inputs_si.resize(kRows, static_cast<Index>(model.features.size()));
  points.joints_ji.resize(kRows, 3);
  Index kept = 0;
  for (const record::Recording* recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::FeatureMatrix rows, model::inputs_of(model, *recording));
    std::array<Index, 3> columns{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string name = fmt::format("jpos.{}", core::kSlotNames[i]);
      const auto column = recording->column(name);
      if (!column) {
        return core::Error{
            core::ErrorCode::kData,
            fmt::format("{}: lacks channel '{}', the posture of the arm", recording->source, name)};
      }
      columns[i] = *column;
    }
    for (Index row = 0; row < rows.rows() && kept < kRows; row += stride) {
      const Eigen::RowVector3d joints(recording->samples(row, columns[0]),
                                      recording->samples(row, columns[1]),
                                      recording->samples(row, columns[2]));
      if (!rows.row(row).allFinite() || !joints.allFinite()) continue;
      points.inputs_si.row(kept) = rows.row(row);
      points.joints_ji.row(kept++) = joints;
    }
  }
  if (kept == 0) {
    return core::Error{core::ErrorCode::kData, "no row without a lost value to linearise at"};
  }
  points.inputs_si.conservativeResize(kept, Eigen::NoChange);
  points.joints_ji.conservativeResize(kept, Eigen::NoChange);
  return points;
}

Margins margins(const model::CalibrationModel& model, const OperatingPoints& points,
                ServoLoop& servo) {
  Margins worst;
  worst.gain.value = std::numeric_limits<double>::infinity();
  worst.phase_rad.value = kPi;
  worst.left_out = unmodelled(model);
  const std::vector<Input> inputs = inputs_of(model, servo.cycle_s());
  if (inputs.empty()) return worst;
  const std::vector<Index> joints = joints_of(model);
  const std::vector<Eigen::MatrixXd> slopes = model::jacobians(model, points.inputs_si);
  const bool signless =
      std::any_of(inputs.begin(), inputs.end(), [](const Input& input) { return input.signless; });
  Tracker tracker(worst);
  for (Index row = 0; row < points.inputs_si.rows(); ++row) {
    const Eigen::MatrixXd& slope = slopes[static_cast<std::size_t>(row)];
    servo.set_posture(points.joints_ji.row(row).transpose());
    for (const double side : {1.0, -1.0}) {
      if (side < 0.0 && !signless) break;
      follow(tracker, servo, row, [&](Complex z) {
        return eigenvalues(loop_transfer(inputs, joints, slope, servo, side, z));
      });
    }
  }
  return worst;
}

core::Result<Margins> margins_with(const physics::Plant& plant,
                                   const model::CalibrationModel& model,
                                   std::span<const record::Recording* const> recordings) {
  const auto arm = model::arm_from(plant.robot.arm).value_or(model::Arm::kUnknown);
  if (arm != model::Arm::kUnknown && model.origin.arm != model::Arm::kUnknown &&
      arm != model.origin.arm) {
    return core::data_error(fmt::format("{}: is of the {} arm, but the model of the {} arm",
                                        plant.source, name_of(arm), name_of(model.origin.arm)));
  }
  RAVENCAL_ASSIGN_OR_RETURN(ServoLoop servo, ServoLoop::create(plant, servo_options(plant, model)));
  RAVENCAL_ASSIGN_OR_RETURN(const OperatingPoints points, operating_points(model, recordings));
  return margins(model, points, servo);
}

std::string describe(const Margins& margins) {
  std::string text =
      describe(margins.gain, "gain margin", margins.gain.value, "", kLeastGainMargin) +
      describe(margins.phase_rad, "phase margin", margins.phase_rad.value * core::kDegPerRad,
               " deg", kLeastPhaseMarginRad * core::kDegPerRad);
  if (!margins.left_out.empty()) {
    text += fmt::format("inputs that answer but are not in the loop's model: {}\n",
                        fmt::join(margins.left_out, ", "));
  }
  return text;
}

}  // namespace ravencal::loop
