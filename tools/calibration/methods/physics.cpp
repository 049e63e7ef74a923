// SPDX-License-Identifier: Apache-2.0
//
// The physics found by `ravencal diagnose` as a calibration: its terms, their sizes fitted to the
// training rows by least squares; and the same with a network on what it leaves.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "methods/network.hpp"
#include "methods/physics_terms.hpp"
#include "methods/scaled_model.hpp"

namespace ravencal::methods {
namespace {

/// Values of a joint's terms over a series [rows x terms]; NaN where not usable.
Eigen::MatrixXd columns_of(Terms& terms, const Series& series) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Constant(series.rows(), terms.count(), std::nan(""));
  Eigen::VectorXd values(terms.count());
  bool fresh = true;
  for (Eigen::Index row = 0; row < series.rows(); ++row) {
    fresh = fresh || series.fresh[static_cast<std::size_t>(row)] != 0;
    if (!series.usable(row)) continue;
    if (fresh) terms.start(series, row);
    fresh = false;
    terms.step(series, row, values);
    columns.row(row) = values.transpose();
  }
  return columns;
}

struct PhysicsJoint {
  std::unique_ptr<Terms> terms;
  Eigen::VectorXd sizes;
};

Eigen::VectorXd fit_sizes(Terms& terms, std::span<const Series> train, Eigen::Index output) {
  const Eigen::Index n = terms.count();
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd cross = Eigen::VectorXd::Zero(n);
  for (const Series& series : train) {
    const Eigen::MatrixXd columns = columns_of(terms, series);
    for (Eigen::Index row = 0; row < series.rows(); ++row) {
      const double error = series.errors(row, output);
      if (!std::isfinite(error) || !columns.row(row).allFinite()) continue;
      gram.selfadjointView<Eigen::Lower>().rankUpdate(columns.row(row).transpose());
      cross += error * columns.row(row).transpose();
    }
  }
  const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt().cwiseMax(1e-300);
  Eigen::MatrixXd unit = gram.selfadjointView<Eigen::Lower>();
  unit = scale.cwiseInverse().asDiagonal() * unit * scale.cwiseInverse().asDiagonal();
  unit.diagonal().array() += 1e-7;
  return unit.ldlt().solve(cross.cwiseQuotient(scale)).cwiseQuotient(scale);
}

class PhysicsPredictor final : public Predictor {
 public:
  explicit PhysicsPredictor(std::vector<PhysicsJoint> joints) : joints_(std::move(joints)) {
    for (const PhysicsJoint& joint : joints_) values_.emplace_back(joint.terms->count());
  }
  void start(const Series& series, Eigen::Index row) override {
    for (PhysicsJoint& joint : joints_) joint.terms->start(series, row);
  }
  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      joints_[k].terms->step(series, row, values_[k]);
      correction[static_cast<Eigen::Index>(k)] = values_[k].dot(joints_[k].sizes);
    }
  }
  [[nodiscard]] std::size_t parameters() const override {
    std::size_t count = 0;
    for (const PhysicsJoint& joint : joints_) count += static_cast<std::size_t>(joint.sizes.size());
    return count;
  }
  [[nodiscard]] std::string remark() const override {
    std::string text = "terms:";
    for (std::size_t k = 0; k < joints_.size(); ++k)
      text += fmt::format("{} {}", k > 0 ? ";" : "", joints_[k].terms->text());
    return text;
  }

 private:
  std::vector<PhysicsJoint> joints_;
  std::vector<Eigen::VectorXd> values_;
};

core::Result<std::unique_ptr<Predictor>> fit_physics(const Problem& problem,
                                                     std::span<const Series> train,
                                                     const Settings& settings) {
  RAVENCAL_ASSIGN_OR_RETURN(auto terms, read_terms(settings.physics, problem));
  std::vector<PhysicsJoint> joints;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    if (!settings.keep_going(static_cast<double>(k) / static_cast<double>(terms.size())))
      return stopped();
    Eigen::VectorXd sizes = fit_sizes(*terms[k], train, static_cast<Eigen::Index>(k));
    if (!sizes.allFinite())
      return core::Error{core::ErrorCode::kData, "no training row has what the physics needs"};
    joints.push_back({std::move(terms[k]), std::move(sizes)});
  }
  return std::unique_ptr<Predictor>(std::make_unique<PhysicsPredictor>(std::move(joints)));
}

std::string needs_diagnosis(const Problem& problem, const Settings& settings) {
  if (problem.order == Order::kPoses) return "needs the path that led to a pose";
  return settings.physics.empty() ? "no diagnosis given (--physics DIR of `ravencal diagnose` on "
                                    "the training recordings)"
                                  : "";
}

class Physics final : public Method {
 public:
  std::string_view id() const override { return "physics"; }
  std::string_view title() const override { return "physics"; }
  std::string_view source() const override { return "ravencal diagnose"; }
  bool ours() const override { return true; }
  std::string why_not_loadable() const override {
    return "convert loads networks; these terms have memories of their own";
  }
  std::string unsuited(const Problem& problem, std::span<const Series>,
                       const Settings& settings) const override {
    return needs_diagnosis(problem, settings);
  }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    return fit_physics(problem, train, settings);
  }
};

/// Physics first, a network for the rest.
class Both final : public Predictor {
 public:
  Both(std::unique_ptr<Predictor> physics, std::unique_ptr<Predictor> network)
      : physics_(std::move(physics)), network_(std::move(network)) {}
  void start(const Series& series, Eigen::Index row) override { physics_->start(series, row); }
  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    physics_->step(series, row, correction);
    Eigen::VectorXd rest(correction.size());
    network_->step(series, row, rest);
    correction += rest;
  }
  Eigen::MatrixXd predict(const Series& series) override {
    return physics_->predict(series) + network_->predict(series);
  }
  [[nodiscard]] std::size_t parameters() const override {
    return physics_->parameters() + network_->parameters();
  }
  [[nodiscard]] std::string remark() const override {
    return physics_->remark() + "; network: " + network_->remark();
  }

 private:
  std::unique_ptr<Predictor> physics_;
  std::unique_ptr<Predictor> network_;
};

class PhysicsNetwork final : public Method {
 public:
  std::string_view id() const override { return "physics_network"; }
  std::string_view title() const override { return "physics + network"; }
  std::string_view source() const override { return "diagnose, then train"; }
  bool ours() const override { return true; }
  std::string why_not_loadable() const override {
    return "convert loads networks; the physics before this one has memories of its own";
  }
  std::string unsuited(const Problem& problem, std::span<const Series>,
                       const Settings& settings) const override {
    return needs_diagnosis(problem, settings);
  }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    RAVENCAL_ASSIGN_OR_RETURN(std::unique_ptr<Predictor> physics,
                              fit_physics(problem, train, settings));
    std::vector<Series> rest(train.begin(), train.end());
    for (Series& series : rest) series.errors -= physics->predict(series);
    const auto columns = static_cast<Eigen::Index>(problem.features.size());
    RAVENCAL_ASSIGN_OR_RETURN(const double penalty,
                              choose_penalty(problem, rest, columns, settings));
    RAVENCAL_ASSIGN_OR_RETURN(
        model::CalibrationModel model,
        train_network(problem, stack(rest, columns), settings, penalty, 0.5, 1.0));
    return std::unique_ptr<Predictor>(std::make_unique<Both>(
        std::move(physics), model_predictor(std::move(model), first_columns(columns),
                                            fmt::format("penalties x {:g}", penalty))));
  }
};

}  // namespace

std::unique_ptr<Method> make_physics() { return std::make_unique<Physics>(); }
std::unique_ptr<Method> make_physics_network() { return std::make_unique<PhysicsNetwork>(); }

}  // namespace ravencal::methods
