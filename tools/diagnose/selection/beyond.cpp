// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/beyond.hpp"

#include <algorithm>
#include <vector>

#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Squared error of each block, every row under a fit without its group.
VectorXd errors_without_group(const ChannelModel& model, const std::vector<int>& group) {
  const MatrixXd columns = model.columns();
  const Index width = columns.cols() + 1;
  MatrixXd joined(columns.rows(), width);
  joined << columns, model.target;
  std::vector<MatrixXd> moments(kFolds, MatrixXd::Zero(width, width));
  for (Index i = 0; i < joined.rows(); ++i) {
    moments[static_cast<std::size_t>(group[static_cast<std::size_t>(i)])]
        .selfadjointView<Eigen::Lower>()
        .rankUpdate(joined.row(i).transpose());
  }
  MatrixXd total = MatrixXd::Zero(width, width);
  for (MatrixXd& m : moments) {
    m.triangularView<Eigen::StrictlyUpper>() = m.transpose();
    total += m;
  }
  MatrixXd fitted(width - 1, kFolds);
  for (int g = 0; g < kFolds; ++g)
    fitted.col(g) =
        solve(total - moments[static_cast<std::size_t>(g)], model.column_precision(width - 1));
  const Blocks& blocks = model.blocks;
  VectorXd errors = VectorXd::Zero(static_cast<Index>(blocks.count()));
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    for (Index i = blocks.first(b); i < blocks.first(b) + blocks.size(b); ++i) {
      const double e =
          model.target[i] - columns.row(i).dot(fitted.col(group[static_cast<std::size_t>(i)]));
      errors[static_cast<Index>(b)] += e * e;
    }
  }
  return errors;
}

/// Groups of equal size by the rank of `x`.
std::vector<int> by_rank(const VectorXd& x) {
  std::vector<double> sorted(x.data(), x.data() + x.size());
  std::sort(sorted.begin(), sorted.end());
  std::vector<int> group;
  for (Index i = 0; i < x.size(); ++i) {
    const auto rank = std::lower_bound(sorted.begin(), sorted.end(), x[i]) - sorted.begin();
    group.push_back(static_cast<int>(rank * kFolds / x.size()));
  }
  return group;
}

/// The position on which an effect depends: another joint's, or the own.
VectorXd position_of(const ChannelModel& model, const EffectForm& form) {
  for (const Companion& other : model.series->others) {
    if (other.name == form.from()) return model.blocks.gather(other.value).col(0);
  }
  return model.blocks.gather(model.series->motion.q).col(0);
}

}  // namespace

bool predicts_beyond(const ChannelModel& with, const ChannelModel& without) {
  const auto gains = [&](const std::vector<int>& group) {
    return z_score(errors_without_group(without, group) - errors_without_group(with, group));
  };
  const Index rows = with.target.size();
  const EffectForm& form = *with.candidates[with.chosen.back().candidate]->form;
  return gains(by_rank(VectorXd::LinSpaced(rows, 0.0, 1.0))) >= kOneError &&
         gains(by_rank(position_of(with, form))) >= kOneError;
}

}  // namespace ravencal::diagnose
