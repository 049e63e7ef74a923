// SPDX-License-Identifier: Apache-2.0
//
// Gaussian-process regression with data cleaning: Mahler et al., "Learning accurate kinematic
// control of cable-driven surgical robots using data cleaning and Gaussian process regression",
// CASE 2014. Squared-exponential kernel with one length per input, found by marginal likelihood on
// a subset; rows that this first process finds implausible are dropped; the rest train a sparse one
// (deterministic training conditional: Quinonero-Candela and Rasmussen, JMLR 6, 2005), whose cost
// is linear in rows.
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>

#include "core/median.hpp"
#include "methods/method.hpp"
#include "methods/scaled_model.hpp"

namespace ravencal::methods {
namespace {

constexpr Eigen::Index kSubset = 400;  ///< rows that choose the lengths
constexpr double kImplausible = 3.5;   ///< robust standard deviations that cleaning drops
constexpr Eigen::Index kBlock = 1024;  ///< rows between two questions whether to go on

/// Logarithms: signal deviation, noise deviation, then one length per input.
struct Kernel {
  Eigen::VectorXd log_parameters;

  [[nodiscard]] double signal_variance() const { return std::exp(2.0 * log_parameters[0]); }
  [[nodiscard]] double noise_variance() const { return std::exp(2.0 * log_parameters[1]) + 1e-8; }
  [[nodiscard]] Eigen::ArrayXd inverse_lengths() const {
    return (-log_parameters.tail(log_parameters.size() - 2).array()).exp();
  }
  /// [columns of a x columns of b]; samples are columns.
  [[nodiscard]] Eigen::MatrixXd between(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const {
    const Eigen::VectorXd scale = inverse_lengths().matrix();
    const Eigen::MatrixXd x = scale.asDiagonal() * a;
    const Eigen::MatrixXd y = scale.asDiagonal() * b;
    Eigen::MatrixXd d = -2.0 * x.transpose() * y;
    d.colwise() += x.colwise().squaredNorm().transpose();
    d.rowwise() += y.colwise().squaredNorm();
    return signal_variance() * (-0.5 * d.array().max(0.0)).exp();
  }
};

/// Negative log marginal likelihood per row and its gradient (Rasmussen and Williams 2006, 5.9).
class Likelihood final : public ceres::FirstOrderFunction {
 public:
  Likelihood(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) : x_(x), y_(y) {}
  int NumParameters() const override { return static_cast<int>(x_.rows()) + 2; }
  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    const Kernel kernel{Eigen::Map<const Eigen::VectorXd>(parameters, NumParameters())};
    if (kernel.log_parameters.cwiseAbs().maxCoeff() > 12.0) return false;
    const Eigen::Index n = x_.cols();
    const Eigen::MatrixXd plain = kernel.between(x_, x_);
    Eigen::MatrixXd k = plain;
    k.diagonal().array() += kernel.noise_variance();
    const Eigen::LLT<Eigen::MatrixXd> llt(k);
    if (llt.info() != Eigen::Success) return false;
    const Eigen::VectorXd alpha = llt.solve(y_);
    const auto rows = static_cast<double>(n);
    // A weak prior draws the lengths to 3, so that inputs without information in the subset have no
    // effect.
    const auto lengths = kernel.log_parameters.tail(x_.rows()).array() - std::log(3.0);
    *cost = (0.5 * y_.dot(alpha) + llt.matrixLLT().diagonal().array().log().sum()) / rows +
            0.01 * lengths.square().sum() / static_cast<double>(x_.rows());
    if (gradient == nullptr) return true;
    Eigen::MatrixXd w = llt.solve(Eigen::MatrixXd::Identity(n, n)) - alpha * alpha.transpose();
    gradient[1] = 0.5 * w.trace() * 2.0 * (kernel.noise_variance() - 1e-8) / rows;
    w.array() *= plain.array();
    gradient[0] = w.sum() / rows;
    const Eigen::ArrayXd inverse = kernel.inverse_lengths();
    for (Eigen::Index d = 0; d < x_.rows(); ++d) {
      const Eigen::VectorXd v = x_.row(d).transpose() * inverse[d];
      const Eigen::VectorXd squares = v.cwiseAbs2();
      // d k / d log length = k * (difference / length)^2.
      const double sum = 2.0 * squares.dot(w.rowwise().sum()) - 2.0 * v.dot(w * v);
      gradient[2 + d] = 0.5 * sum / rows + 0.02 * lengths[d] / static_cast<double>(x_.rows());
    }
    return true;
  }

 private:
  const Eigen::MatrixXd& x_;
  const Eigen::VectorXd& y_;
};

/// `count` columns evenly through `x`.
std::vector<Eigen::Index> evenly(Eigen::Index columns, Eigen::Index count) {
  count = std::min(count, columns);
  std::vector<Eigen::Index> chosen;
  for (Eigen::Index i = 0; i < count; ++i) chosen.push_back(i * columns / count);
  return chosen;
}

/// False: the fit ends early, and what it returns is of no use.
using GoOn = std::function<bool()>;

class AsksEachIteration final : public ceres::IterationCallback {
 public:
  explicit AsksEachIteration(const GoOn& go_on) : go_on_(go_on) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& /*summary*/) override {
    return go_on_() ? ceres::SOLVER_CONTINUE : ceres::SOLVER_ABORT;
  }

 private:
  const GoOn& go_on_;
};

Kernel fit_kernel(const Eigen::MatrixXd& x, const Eigen::VectorXd& y, const GoOn& go_on) {
  const double deviation = std::sqrt(y.squaredNorm() / static_cast<double>(y.size())) + 1e-6;
  Kernel kernel{Eigen::VectorXd::Constant(x.rows() + 2, std::log(3.0))};
  kernel.log_parameters[0] = std::log(deviation);
  kernel.log_parameters[1] = std::log(0.2 * deviation);
  ceres::GradientProblem problem(new Likelihood(x, y));
  ceres::GradientProblemSolver::Options options;
  options.max_num_iterations = 60;
  options.logging_type = ceres::SILENT;
  AsksEachIteration asks(go_on);
  options.callbacks.push_back(&asks);
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(options, problem, kernel.log_parameters.data(), &summary);
  return kernel;
}

/// One output: mean prediction = k(x, inducing) * weights.
struct Process {
  Kernel kernel;
  Eigen::MatrixXd inducing;  ///< [inputs x points]
  Eigen::VectorXd weights;

  [[nodiscard]] Eigen::VectorXd predict(const Eigen::MatrixXd& x) const {
    return kernel.between(x, inducing) * weights;
  }
};

Process fit_sparse(Kernel kernel, const Eigen::MatrixXd& x, const Eigen::VectorXd& y,
                   Eigen::Index points, const GoOn& go_on) {
  Process process;
  process.inducing = x(Eigen::all, evenly(x.cols(), points));
  const Eigen::Index m = process.inducing.cols();
  Eigen::MatrixXd gram =
      kernel.noise_variance() * kernel.between(process.inducing, process.inducing);
  Eigen::VectorXd cross = Eigen::VectorXd::Zero(m);
  for (Eigen::Index at = 0; at < x.cols() && go_on(); at += kBlock) {
    const Eigen::Index count = std::min(kBlock, x.cols() - at);
    const Eigen::MatrixXd k = kernel.between(x.middleCols(at, count), process.inducing);
    gram.selfadjointView<Eigen::Lower>().rankUpdate(k.transpose());
    cross.noalias() += k.transpose() * y.segment(at, count);
  }
  gram.diagonal().array() += 1e-8 * gram.diagonal().mean();
  process.weights = gram.selfadjointView<Eigen::Lower>().ldlt().solve(cross);
  process.kernel = std::move(kernel);
  return process;
}

/// Rows that the process of a subset finds plausible.
std::vector<Eigen::Index> plausible(const Process& process, const Eigen::MatrixXd& x,
                                    const Eigen::VectorXd& y, const GoOn& go_on) {
  Eigen::VectorXd left = Eigen::VectorXd::Zero(y.size());
  for (Eigen::Index at = 0; at < x.cols() && go_on(); at += kBlock) {
    const Eigen::Index count = std::min(kBlock, x.cols() - at);
    left.segment(at, count) =
        (y.segment(at, count) - process.predict(x.middleCols(at, count))).cwiseAbs();
  }
  std::vector<double> sizes(left.data(), left.data() + left.size());
  const double deviation = core::kNormalPerMad * core::upper_median(sizes);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    if (left[i] <= kImplausible * deviation) kept.push_back(i);
  }
  return kept;
}

class GaussianPredictor final : public Predictor {
 public:
  GaussianPredictor(model::CalibrationModel frame, std::vector<Process> processes,
                    double dropped_share)
      : frame_(std::move(frame)), processes_(std::move(processes)), dropped_(dropped_share) {}

  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    const Eigen::VectorXd x =
        (series.inputs.row(row).head(frame_.input.mean.size()).transpose() - frame_.input.mean)
            .cwiseQuotient(frame_.input.scale);
    for (std::size_t k = 0; k < processes_.size(); ++k) {
      const auto o = static_cast<Eigen::Index>(k);
      correction[o] = processes_[k].predict(x)[0] * frame_.output.scale[o] + frame_.output.mean[o];
    }
  }
  [[nodiscard]] std::size_t parameters() const override {
    std::size_t count = 0;
    for (const Process& p : processes_)
      count += static_cast<std::size_t>(p.inducing.size() + p.weights.size() +
                                        p.kernel.log_parameters.size());
    return count;
  }
  [[nodiscard]] std::string remark() const override {
    return fmt::format("{} inducing points, cleaning dropped {:.1f} % of the rows",
                       processes_.front().inducing.cols(), 100.0 * dropped_);
  }

 private:
  model::CalibrationModel frame_;
  std::vector<Process> processes_;
  double dropped_;
};

class GaussianProcess final : public Method {
 public:
  std::string_view id() const override { return "gp"; }
  std::string_view title() const override { return "Gaussian process, cleaned data"; }
  std::string_view source() const override { return "Mahler et al., CASE 2014"; }
  std::string why_not_loadable() const override { return "convert has no kernel methods"; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    const Stack data = stack(train, problem.plain);
    if (data.errors.rows() == 0)
      return core::Error{core::ErrorCode::kData,
                         "no training row has every feature and every joint's error"};
    model::CalibrationModel frame = frame_of(problem, first_columns(problem.plain), data);
    const Eigen::MatrixXd x = scaled_inputs(frame, data);
    const Eigen::MatrixXd y = scaled_errors(frame, data);
    std::vector<Process> processes;
    double dropped = 0.0;
    for (Eigen::Index k = 0; k < y.rows(); ++k) {
      const GoOn go_on = [&] {
        return settings.keep_going(static_cast<double>(k) / static_cast<double>(y.rows()));
      };
      const Eigen::VectorXd target = y.row(k).transpose();
      const auto subset = evenly(x.cols(), kSubset);
      Kernel kernel = fit_kernel(x(Eigen::all, subset), target(subset), go_on);
      const Process first =
          fit_sparse(kernel, x(Eigen::all, subset), target(subset), settings.inducing, go_on);
      const std::vector<Eigen::Index> kept = plausible(first, x, target, go_on);
      dropped += 1.0 - static_cast<double>(kept.size()) / static_cast<double>(x.cols());
      processes.push_back(fit_sparse(std::move(kernel), x(Eigen::all, kept), target(kept),
                                     settings.inducing, go_on));
      if (!go_on()) return stopped();
    }
    dropped /= static_cast<double>(y.rows());
    return std::unique_ptr<Predictor>(
        std::make_unique<GaussianPredictor>(std::move(frame), std::move(processes), dropped));
  }
};

}  // namespace

std::unique_ptr<Method> make_gaussian_process() { return std::make_unique<GaussianProcess>(); }

}  // namespace ravencal::methods
