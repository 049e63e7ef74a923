// SPDX-License-Identifier: Apache-2.0
//
// Models from elsewhere in the plugin itself: the file's maker, the blob and the real-time kernels
// agree on the same inputs.
#include <gtest/gtest.h>

#include "conversion/assemble.hpp"
#include "conversion/window.hpp"
#include "rt/rig.hpp"
#include "unit/conversion_models.hpp"

namespace ravencal::test {
namespace {

constexpr double kOutputScale = 1e-3;  // an arm's errors, far below what the plugin would clamp
constexpr int kTicksPerRow = 10;       // rows of 10 ms

/// Inputs of the file as small motion around the healthy state, where nothing jumps.
class PluginWithForeignModel {
 public:
  explicit PluginWithForeignModel(const conversion::ForeignModel& source,
                                  const Expected& expected) {
    conversion::ScalingFile scaling = plain_scaling(source, 1.0);
    const ravencal_state state = healthy_state();
    centre_ = {static_cast<double>(state.arm[0].jpos_ji[0]),
               static_cast<double>(state.arm[0].jpos_ji[1]),
               static_cast<double>(state.arm[0].jpos_ji[2]),
               static_cast<double>(state.arm[0].mpos_rad[1])};
    const Eigen::Vector4d spread = spread_of(expected);
    unit_ = 0.02 * spread.cwiseInverse();
    // x_file = (x_si - centre) / unit: as a unit and a scaling of the scaling file where the graph
    // has none of its own, and by way of the graph's own input scaling otherwise.
    source_ = source;
    if (scaling.input) {
      scaling.input->mean = Eigen::Map<const Eigen::VectorXd>(centre_.data(), 4);
      scaling.input->scale = unit_;
    } else {
      auto& affine = source_.network.input;
      affine.offset -= affine.gain.cwiseProduct(
          Eigen::Map<const Eigen::VectorXd>(centre_.data(), 4).cwiseQuotient(unit_));
      affine.gain = affine.gain.cwiseQuotient(unit_);
    }
    if (scaling.output) {
      scaling.output->scale *= kOutputScale;
    } else {
      source_.network.output.gain *= kOutputScale;
      source_.network.output.offset *= kOutputScale;
    }
    scaling.input_min = Eigen::VectorXd::Constant(4, -10.0);
    scaling.input_max = Eigen::VectorXd::Constant(4, 10.0);
    auto model = conversion::assemble(source_, scaling, {});
    EXPECT_TRUE(model.ok()) << model.error().message;
    if (model.ok()) model_ = std::move(*model);
  }

  /// What the plugin predicts once it has seen the window of `row`, in the file's units.
  Eigen::RowVector2d predict(const Expected& expected, Eigen::Index row) {
    Rig rig;
    rig.load(model_);
    rig.enable();
    for (std::size_t k = 0; k < expected.samples.size(); ++k) {
      for (int tick = 0; tick < (k == 0 ? 1 : kTicksPerRow); ++tick) {
        // Between two samples in a straight line, so that nothing jumps; they count where it ends.
        const double share = static_cast<double>(tick + 1) / kTicksPerRow;
        const Eigen::RowVectorXd to = expected.samples[k].row(row);
        const Eigen::RowVectorXd from = k == 0 ? to : expected.samples[k - 1].row(row).eval();
        const Eigen::RowVectorXd x = from + (k == 0 ? 1.0 : share) * (to - from);
        for (int i = 0; i < 3; ++i) {
          rig.state.arm[0].jpos_ji[i] =
              static_cast<float>(centre_[static_cast<std::size_t>(i)] + unit_[i] * x[i]);
        }
        rig.state.arm[0].mpos_rad[1] = static_cast<float>(centre_[3] + unit_[3] * x[3]);
        rig.tick();
      }
    }
    EXPECT_EQ(rig.output.doubts & (RAVENCAL_DOUBT_NETWORK | RAVENCAL_DOUBT_WARMING_UP), 0U);
    return Eigen::RowVector2d(static_cast<double>(rig.output.predicted_ji[0]),
                              static_cast<double>(rig.output.predicted_ji[2])) /
           kOutputScale;
  }

 private:
  static Eigen::Vector4d spread_of(const Expected& expected) {
    Eigen::Vector4d spread = Eigen::Vector4d::Zero();
    for (const auto& sample : expected.samples) {
      spread = spread.cwiseMax(sample.cwiseAbs().colwise().maxCoeff().transpose());
    }
    return spread;
  }

  std::vector<double> centre_;
  Eigen::VectorXd unit_;
  conversion::ForeignModel source_;
  model::CalibrationModel model_;
};

TEST(ForeignModelInThePlugin, PredictsWhatItsMakerSays) {
  for (const Expected& expected : expected_models()) {
    const auto source = read_foreign(kModels / expected.file);
    ASSERT_TRUE(source.ok()) << source.error().message;
    PluginWithForeignModel plugin(*source, expected);
    const double size = expected.outputs.cwiseAbs().maxCoeff();
    for (Eigen::Index row = 0; row < expected.outputs.rows(); ++row) {
      const Eigen::RowVector2d predicted = plugin.predict(expected, row);
      // A state of 0.3 rad in f32 is known to 3e-8, which is 1.5e-6 of the largest input's 0.02; a
      // network of these sizes does not amplify it a hundred times.
      EXPECT_LT((predicted - expected.outputs.row(row)).cwiseAbs().maxCoeff(), 1e-4 * size)
          << expected.file << " row " << row;
    }
  }
}

}  // namespace
}  // namespace ravencal::test
