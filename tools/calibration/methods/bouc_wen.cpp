// SPDX-License-Identifier: Apache-2.0
//
// A cable's hysteresis after Bouc and Wen (a Duhem model), fitted to the data: Miyasaka,
// Haghighipanah, Li, Hannaford, "Hysteresis model of longitudinally loaded cable for cable driven
// robots and identification of the parameters", ICRA 2016. Joint by joint:
//   error = offset + linear in the inputs that all methods get (gain, coupling, compliance) + loop
//   * z dz    = dq / width * [1 - |z|^n (share + (1 - share) sgn(dq z))],  q: the joint's own
//   position
// Width, share and n are found by Ceres, the linear coefficients by least squares inside (variable
// projection: Golub and Pereyra 1973).
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "methods/method.hpp"

namespace ravencal::methods {
namespace {

struct Loop {
  double width = 1.0;
  double share = 0.5;
  double exponent = 1.0;

  /// z after the position has changed by `change`: explicit steps of at most an eighth of the
  /// width.
  [[nodiscard]] double advance(double z, double change) const {
    const double steps = std::min(200.0, std::ceil(8.0 * std::abs(change) / width));
    if (steps <= 0.0) return z;
    const double dx = change / width / steps;
    for (double i = 0.0; i < steps; ++i) {
      const double against = dx * z >= 0.0 ? 1.0 : -1.0;
      z += dx * (1.0 - std::pow(std::abs(z), exponent) * (share + (1.0 - share) * against));
      z = std::clamp(z, -1.0, 1.0);
    }
    return z;
  }
};

/// Unbounded parameters of a loop: log width, logit share, log exponent.
Loop loop_of(const double* p) {
  return {std::exp(p[0]), 1.0 / (1.0 + std::exp(-p[1])), std::exp(p[2])};
}

/// Row of linear regressors but z: 1, the plain inputs, the joint's own position.
Eigen::RowVectorXd linear_row(const Series& s, Eigen::Index row, Eigen::Index output,
                              Eigen::Index plain) {
  Eigen::RowVectorXd a(plain + 2);
  a[0] = 1.0;
  a.segment(1, plain) = s.inputs.row(row).head(plain);
  a[plain + 1] = s.estimate(row, output);
  return a;
}

/// Stacked training rows of one output.
struct LoopRows {
  Eigen::MatrixXd linear;
  Eigen::VectorXd errors;
  std::vector<double> change;  ///< of the joint since the row before; NaN begins an episode
  std::vector<char> counts;    ///< 1 where the error is known
};

LoopRows rows_of(std::span<const Series> train, Eigen::Index output, Eigen::Index plain) {
  LoopRows rows;
  rows.linear.resize(count_rows(train), plain + 2);
  rows.errors.resize(count_rows(train));
  Eigen::Index at = 0;
  for (const Series& s : train) {
    double last = 0.0;
    bool fresh = true;
    for (Eigen::Index row = 0; row < s.rows(); ++row) {
      fresh = fresh || s.fresh[static_cast<std::size_t>(row)] != 0;
      const double q = s.estimate(row, output);
      if (!std::isfinite(q) || !s.usable(row)) continue;
      rows.change.push_back(fresh ? std::nan("") : q - last);
      last = q;
      fresh = false;
      const double error = s.errors(row, output);
      rows.counts.push_back(std::isfinite(error) ? 1 : 0);
      rows.linear.row(at) = linear_row(s, row, output, plain);
      rows.errors[at++] = std::isfinite(error) ? error : 0.0;
    }
  }
  rows.linear.conservativeResize(at, Eigen::NoChange);
  rows.errors.conservativeResize(at);
  return rows;
}

struct Fitted {
  Loop loop;
  Eigen::VectorXd coefficients;  ///< of linear_row, then of z
  Eigen::VectorXd residual;
};

Fitted project(const LoopRows& rows, const Loop& loop) {
  const Eigen::Index n = rows.linear.cols() + 1;
  Eigen::MatrixXd a(rows.linear.rows(), n);
  a.leftCols(n - 1) = rows.linear;
  double z = 0.0;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const double change = rows.change[static_cast<std::size_t>(i)];
    z = std::isfinite(change) ? loop.advance(z, change) : 0.0;
    a(i, n - 1) = z;
    if (rows.counts[static_cast<std::size_t>(i)] == 0) a.row(i).setZero();
  }
  // Columns of different units, some of them zero: scaled normal equations with a trace of ridge.
  const Eigen::VectorXd scale = a.colwise().norm().transpose().cwiseMax(1e-300);
  const Eigen::MatrixXd unit = a * scale.cwiseInverse().asDiagonal();
  Eigen::MatrixXd gram = unit.transpose() * unit;
  gram.diagonal().array() += 1e-9;
  Fitted fitted;
  fitted.loop = loop;
  fitted.coefficients = gram.ldlt().solve(unit.transpose() * rows.errors).cwiseQuotient(scale);
  fitted.residual = rows.errors - a * fitted.coefficients;
  return fitted;
}

struct LoopCost {
  const LoopRows* rows;
  double scale;
  bool operator()(double const* const* parameters, double* residuals) const {
    const Fitted fitted = project(*rows, loop_of(parameters[0]));
    Eigen::Map<Eigen::VectorXd>(residuals, fitted.residual.size()) = scale * fitted.residual;
    return fitted.residual.allFinite();
  }
};

/// Best of several starts: the cost has a local minimum at each scale of motion.
Fitted fit_loop(const LoopRows& rows, double range) {
  Fitted best;
  for (const double part : {0.01, 0.05, 0.2}) {
    std::array<double, 3> p = {std::log(part * range), 0.0, 0.0};
    ceres::Problem problem;
    auto* cost = new ceres::DynamicNumericDiffCostFunction<LoopCost>(
        new LoopCost{&rows, 1.0 / (1e-12 + rows.errors.norm())});
    cost->AddParameterBlock(3);
    cost->SetNumResiduals(static_cast<int>(rows.errors.size()));
    problem.AddResidualBlock(cost, nullptr, p.data());
    problem.SetParameterLowerBound(p.data(), 0, std::log(1e-4 * range));
    problem.SetParameterUpperBound(p.data(), 0, std::log(range));
    for (const int i : {1, 2}) {
      problem.SetParameterLowerBound(p.data(), i, i == 1 ? -4.0 : -1.0);
      problem.SetParameterUpperBound(p.data(), i, i == 1 ? 4.0 : 2.0);
    }
    ceres::Solver::Options options;
    options.max_num_iterations = 15;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    Fitted fitted = project(rows, loop_of(p.data()));
    if (best.residual.size() == 0 || fitted.residual.squaredNorm() < best.residual.squaredNorm())
      best = std::move(fitted);
  }
  return best;
}

class BoucWenPredictor final : public Predictor {
 public:
  explicit BoucWenPredictor(std::vector<Fitted> joints)
      : joints_(std::move(joints)), z_(joints_.size(), 0.0), last_(joints_.size(), 0.0) {}

  void start(const Series& series, Eigen::Index row) override {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      z_[k] = 0.0;
      last_[k] = series.estimate(row, static_cast<Eigen::Index>(k));
    }
  }
  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const auto output = static_cast<Eigen::Index>(k);
      const double q = series.estimate(row, output);
      if (!std::isfinite(q)) {
        correction[output] = q;
        continue;
      }
      z_[k] = joints_[k].loop.advance(z_[k], q - last_[k]);
      last_[k] = q;
      const Eigen::VectorXd& c = joints_[k].coefficients;
      const Eigen::Index n = c.size() - 1;
      correction[output] = linear_row(series, row, output, n - 2).dot(c.head(n)) + c[n] * z_[k];
    }
  }
  [[nodiscard]] std::size_t parameters() const override {
    return joints_.size() * (3 + static_cast<std::size_t>(joints_.front().coefficients.size()));
  }
  [[nodiscard]] std::string remark() const override {
    std::string text = "loop height and width:";
    for (const Fitted& joint : joints_)
      text += fmt::format(" {:.3g}/{:.3g}", joint.coefficients.tail(1)[0], joint.loop.width);
    return text;
  }

 private:
  std::vector<Fitted> joints_;
  std::vector<double> z_;
  std::vector<double> last_;
};

class BoucWen final : public Method {
 public:
  std::string_view id() const override { return "bouc_wen"; }
  std::string_view title() const override { return "Bouc-Wen cable"; }
  std::string_view source() const override { return "Miyasaka et al., ICRA 2016"; }
  std::string why_not_loadable() const override { return "convert has no Bouc-Wen state"; }
  std::string unsuited(const Problem& problem, std::span<const Series>,
                       const Settings&) const override {
    return problem.order == Order::kPoses ? "needs the path that led to a pose" : "";
  }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    std::vector<Fitted> joints;
    for (std::size_t k = 0; k < problem.outputs.size(); ++k) {
      if (!settings.keep_going(static_cast<double>(k) /
                               static_cast<double>(problem.outputs.size())))
        return stopped();
      const auto output = static_cast<Eigen::Index>(k);
      const LoopRows rows = rows_of(train, output, problem.plain);
      if (rows.errors.size() == 0)
        return core::Error{core::ErrorCode::kData, "no training row has the joints' positions"};
      const auto q = rows.linear.rightCols(1);
      joints.push_back(fit_loop(rows, std::max(1e-9, q.maxCoeff() - q.minCoeff())));
      if (!joints.back().residual.allFinite())
        return core::Error{core::ErrorCode::kData,
                           "joint " + problem.outputs[k].joint + ": the fit of the cable diverged"};
      joints.back().residual.resize(0);
    }
    return std::unique_ptr<Predictor>(std::make_unique<BoucWenPredictor>(std::move(joints)));
  }
};

}  // namespace

std::unique_ptr<Method> make_bouc_wen() { return std::make_unique<BoucWen>(); }

}  // namespace ravencal::methods
