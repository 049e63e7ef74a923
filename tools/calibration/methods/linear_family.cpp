// SPDX-License-Identifier: Apache-2.0
//
// Methods without memory and with closed solutions: nothing, the mean, linear, ridge, polynomial;
// and ridge regression on the network's own inputs, which separates the effect of the inputs from
// that of the network.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <array>

#include "learn/linear.hpp"
#include "methods/blocked.hpp"
#include "methods/scaled_model.hpp"

namespace ravencal::methods {
namespace {

/// Per scaled input: penalty on squared weights over the mean squared error.
constexpr std::array kRidges = {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1};
constexpr std::array kProductRidges = {1e-6, 1e-4, 1e-2};

core::Error no_rows() {
  return {core::ErrorCode::kData, "no training row has every feature and every joint's error"};
}

class Constant final : public Predictor {
 public:
  Constant(Eigen::VectorXd value, std::size_t parameters)
      : value_(std::move(value)), parameters_(parameters) {}
  void step(const Series&, Eigen::Index, Eigen::Ref<Eigen::VectorXd> correction) override {
    correction = value_;
  }
  [[nodiscard]] std::size_t parameters() const override { return parameters_; }

 private:
  Eigen::VectorXd value_;
  std::size_t parameters_;
};

class Raw final : public Method {
 public:
  std::string_view id() const override { return "raw"; }
  std::string_view title() const override { return "raw estimate"; }
  std::string_view source() const override { return "the robot"; }
  std::string why_not_loadable() const override { return "there is nothing to load"; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem, std::span<const Series>,
                                               const Settings&) const override {
    const auto outputs = static_cast<Eigen::Index>(problem.outputs.size());
    return std::unique_ptr<Predictor>(
        std::make_unique<Constant>(Eigen::VectorXd::Zero(outputs), 0));
  }
};

class Bias final : public Method {
 public:
  std::string_view id() const override { return "bias"; }
  std::string_view title() const override { return "bias removed"; }
  std::string_view source() const override { return "arXiv 2302.04999, baseline"; }
  std::string why_not_loadable() const override {
    return "convert needs a network; a linear one does the same";
  }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem&, std::span<const Series> train,
                                               const Settings&) const override {
    const Stack data = stack(train, 0);
    if (data.errors.rows() == 0) return no_rows();
    const Eigen::VectorXd mean = data.errors.colwise().mean().transpose();
    return std::unique_ptr<Predictor>(
        std::make_unique<Constant>(mean, static_cast<std::size_t>(mean.size())));
  }
};

core::Result<std::unique_ptr<Predictor>> fit_ridge(const Problem& problem,
                                                   std::span<const Series> train,
                                                   Eigen::Index columns, double ridge,
                                                   std::string remark) {
  const Stack data = stack(train, columns);
  if (data.errors.rows() == 0) return no_rows();
  const std::vector<Eigen::Index> used = first_columns(columns);
  model::CalibrationModel model = frame_of(problem, used, data);
  model.layers = {learn::fit_linear(scaled_inputs(model, data).transpose(),
                                    scaled_errors(model, data).transpose(), ridge)};
  model.provenance["settings"] = fmt::format("linear regression, ridge {}", ridge);
  return model_predictor(std::move(model), used, std::move(remark));
}

/// Linear or ridge regression on the plain inputs, or on all of them.
class Linear final : public Method {
 public:
  struct Words {
    std::string_view id, title, source;
    bool ridge = false;
    bool memory = false;
  };
  explicit Linear(Words words) : words_(words) {}
  std::string_view id() const override { return words_.id; }
  std::string_view title() const override { return words_.title; }
  std::string_view source() const override { return words_.source; }
  bool ours() const override { return words_.memory; }
  std::string unsuited(const Problem& problem, std::span<const Series>,
                       const Settings&) const override {
    const bool has_memory = problem.plain < static_cast<Eigen::Index>(problem.features.size());
    return words_.memory && !has_memory ? "no play operators among the inputs (--play)" : "";
  }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings&) const override {
    const Eigen::Index columns =
        words_.memory ? static_cast<Eigen::Index>(problem.features.size()) : problem.plain;
    if (!words_.ridge) return fit_ridge(problem, train, columns, 0.0, {});
    RAVENCAL_ASSIGN_OR_RETURN(
        const std::size_t best,
        choose(train, kRidges.size(), [&](std::size_t c, std::span<const Series> part) {
          return fit_ridge(problem, part, columns, kRidges[c], {});
        }));
    return fit_ridge(problem, train, columns, kRidges[best],
                     fmt::format("ridge {:g}", kRidges[best]));
  }

 private:
  Words words_;
};

/// Inputs for products. With many inputs these are the joints' estimates alone, because the number
/// of products grows with the square.
constexpr Eigen::Index kMostProductInputs = 40;

/// Monomials of scaled inputs up to a degree of 2 or 3 (squares and cubes of one, products of two).
class Monomials {
 public:
  Monomials(Eigen::Index inputs, int degree) : inputs_(inputs), degree_(degree) {}
  [[nodiscard]] Eigen::Index count() const {
    return inputs_ + inputs_ * (inputs_ + 1) / 2 + (degree_ > 2 ? inputs_ : 0);
  }
  [[nodiscard]] Eigen::VectorXd of(const Eigen::VectorXd& x) const {
    Eigen::VectorXd m(count());
    m.head(inputs_) = x;
    Eigen::Index at = inputs_;
    for (Eigen::Index i = 0; i < inputs_; ++i) {
      for (Eigen::Index j = i; j < inputs_; ++j) m[at++] = x[i] * x[j];
    }
    if (degree_ > 2) m.tail(inputs_) = x.array().cube();
    return m;
  }

 private:
  Eigen::Index inputs_;
  int degree_;
};

class PolynomialPredictor final : public Predictor {
 public:
  PolynomialPredictor(const Stack& data, std::vector<Eigen::Index> columns, int degree,
                      double ridge, const model::CalibrationModel& frame)
      : columns_(std::move(columns)),
        monomials_(static_cast<Eigen::Index>(columns_.size()), degree),
        input_(frame.input),
        degree_(degree),
        ridge_(ridge) {
    const Eigen::Index n = monomials_.count() + 1;
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
    Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(n, data.errors.cols());
    constexpr Eigen::Index kRows = 512;
    for (Eigen::Index row = 0; row < data.inputs.rows(); row += kRows) {
      const Eigen::Index count = std::min(kRows, data.inputs.rows() - row);
      Eigen::MatrixXd block(count, n);
      for (Eigen::Index i = 0; i < count; ++i)
        block.row(i) = basis(data.inputs.row(row + i)(columns_).transpose()).transpose();
      gram.selfadjointView<Eigen::Lower>().rankUpdate(block.transpose());
      cross.noalias() += block.transpose() * data.errors.middleRows(row, count);
    }
    const double weight = ridge * static_cast<double>(data.inputs.rows());
    for (Eigen::Index i = 1; i < n; ++i) gram(i, i) += weight;
    weights_ = gram.selfadjointView<Eigen::Lower>().ldlt().solve(cross).transpose();
  }

  void step(const Series& series, Eigen::Index row,
            Eigen::Ref<Eigen::VectorXd> correction) override {
    correction.noalias() = weights_ * basis(series.inputs.row(row)(columns_).transpose());
  }
  [[nodiscard]] std::size_t parameters() const override {
    return static_cast<std::size_t>(weights_.size());
  }
  [[nodiscard]] std::string remark() const override {
    return fmt::format("degree {}, ridge {:g}, {} inputs", degree_, ridge_, columns_.size());
  }

 private:
  [[nodiscard]] Eigen::VectorXd basis(const Eigen::VectorXd& inputs) const {
    Eigen::VectorXd b(monomials_.count() + 1);
    b[0] = 1.0;
    // Outside the trained range cubes explode; three deviations hold nearly all training rows.
    b.tail(monomials_.count()) = monomials_.of(
        ((inputs - input_.mean).array() / input_.scale.array()).max(-4.0).min(4.0).matrix());
    return b;
  }

  std::vector<Eigen::Index> columns_;
  Monomials monomials_;
  model::Standardiser input_;
  int degree_;
  double ridge_;
  Eigen::MatrixXd weights_;
};

class Polynomial final : public Method {
 public:
  std::string_view id() const override { return "polynomial"; }
  std::string_view title() const override { return "polynomial"; }
  std::string_view source() const override { return "degree 2 or 3, ridge"; }
  std::string why_not_loadable() const override { return "convert has no products of inputs"; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings&) const override {
    std::vector<Eigen::Index> columns;
    for (Eigen::Index c = 0; c < problem.plain; ++c) {
      const bool joint = std::any_of(
          problem.outputs.begin(), problem.outputs.end(), [&](const model::OutputSpec& o) {
            return o.estimate_channel == problem.features[static_cast<std::size_t>(c)].channel;
          });
      if (problem.plain <= kMostProductInputs || joint) columns.push_back(c);
    }
    if (columns.empty()) columns = first_columns(std::min(problem.plain, kMostProductInputs));
    const auto candidate =
        [&](std::size_t c,
            std::span<const Series> part) -> core::Result<std::unique_ptr<Predictor>> {
      const Stack data = stack(part, problem.plain);
      if (data.errors.rows() == 0) return no_rows();
      return std::unique_ptr<Predictor>(std::make_unique<PolynomialPredictor>(
          data, columns, c < kProductRidges.size() ? 2 : 3,
          kProductRidges[c % kProductRidges.size()], frame_of(problem, columns, data)));
    };
    RAVENCAL_ASSIGN_OR_RETURN(const std::size_t best,
                              choose(train, 2 * kProductRidges.size(), candidate));
    return candidate(best, train);
  }
};

}  // namespace

std::unique_ptr<Method> make_raw() { return std::make_unique<Raw>(); }
std::unique_ptr<Method> make_bias() { return std::make_unique<Bias>(); }
std::unique_ptr<Method> make_linear() {
  return std::make_unique<Linear>(
      Linear::Words{"linear", "linear regression", "arXiv 2408.01604", false, false});
}
std::unique_ptr<Method> make_ridge() {
  return std::make_unique<Linear>(
      Linear::Words{"ridge", "ridge regression", "Hoerl and Kennard 1970", true, false});
}
std::unique_ptr<Method> make_ridge_memory() {
  return std::make_unique<Linear>(Linear::Words{"ridge_memory", "ridge on inputs with memory",
                                                "train --hidden none --play", true, true});
}
std::unique_ptr<Method> make_polynomial() { return std::make_unique<Polynomial>(); }

}  // namespace ravencal::methods
