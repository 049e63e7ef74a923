// SPDX-License-Identifier: Apache-2.0
//
// An effort (or, where only positions are compared, its lag) that depends on posture alone. Where
// the plant has no links the shape is not known; variants offer more and more general ones, and
// cross-validation takes the one that predicts best.
#include <algorithm>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;

class Gravity final : public EffectForm {
 public:
  Gravity() : EffectForm("gravity") {}
  std::string untestable(const Series& s) const override {
    return range_of(s, s.motion.q) > 20.0 * s.rest_width() ? "" : "the joint hardly moves";
  }
  std::vector<Shape> grid(const Series& s) const override {
    // Through a few degrees sine and cosine are a line and a parabola, which no weight bends so.
    constexpr double kLeastTurn_rad = 0.5;
    std::vector<Shape> shapes = {{0.0}};
    if (!s.prismatic && range_of(s, s.motion.q) > kLeastTurn_rad) shapes.push_back({1.0});
    if (!s.others.empty()) shapes.insert(shapes.end(), {{2.0}, {3.0}});
    return shapes;
  }
  /// 0: own position; 1: its sine and cosine; 2: with the first two others; 3: squares and
  /// products.
  Eigen::MatrixXd columns(const Series& s, const Shape& shape) const override {
    std::vector<Eigen::VectorXd> x = {scaled(s, s.motion.q)};
    if (shape[0] == 1.0) {
      x = {s.motion.q.array().sin().matrix(), s.motion.q.array().cos().matrix()};
      for (auto& column : x) column = centred(s, column);
    }
    if (shape[0] >= 2.0) {
      // Weight acts on the first joints of an arm; the wrist's say little about it.
      for (std::size_t k = 0; k < std::min<std::size_t>(s.others.size(), 2); ++k)
        x.push_back(scaled(s, s.others[k].value));
    }
    if (shape[0] == 3.0) {
      const std::size_t count = x.size();
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = i; k < count; ++k) x.push_back(centred(s, x[i].cwiseProduct(x[k])));
      }
    }
    Eigen::MatrixXd out(s.rows(), static_cast<Index>(x.size()));
    for (std::size_t c = 0; c < x.size(); ++c) out.col(static_cast<Index>(c)) = x[c];
    return out;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape& shape,
                                        const Eigen::VectorXd& b) const override {
    const Eigen::VectorXd effort = columns(s, shape) * b;
    return {{"posture_effort_rms", s.training_rms(effort), amplitude_unit(s)}};
  }
  std::vector<std::string> twins(const Series& s) const override {
    if (s.stage == Stage::kTracking) return {"payload", "coupling"};
    return {"payload"};
  }
  std::string separate_by() const override {
    return "the same motion with 0 and 500 g on the tool: weight adds in proportion, cables that "
           "pull with posture do not";
  }
};

}  // namespace

std::unique_ptr<EffectForm> gravity() { return std::make_unique<Gravity>(); }

}  // namespace ravencal::diagnose
