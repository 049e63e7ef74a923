// SPDX-License-Identifier: Apache-2.0
#include "prove/leak.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "prove/parallel.hpp"
#include "prove/workspace.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kVanishing = 1e-3;  // times the floor

/// Ranks in [-1, 1]: no unit or outlier dominates the classifier.
MatrixXd ranks(const std::vector<std::vector<double>>& features) {
  const auto rows = static_cast<Index>(features.size());
  const auto columns = static_cast<Index>(features.front().size());
  MatrixXd out(rows, columns);
  for (Index c = 0; c < columns; ++c) {
    for (Index r = 0; r < rows; ++r) {
      double below = 0.0, equal = 0.0;
      const double x = features[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
      for (const auto& other : features) {
        below += other[static_cast<std::size_t>(c)] < x ? 1.0 : 0.0;
        equal += other[static_cast<std::size_t>(c)] == x ? 1.0 : 0.0;
      }
      out(r, c) = (2.0 * below + equal) / static_cast<double>(rows) - 1.0;
    }
  }
  return out;
}

/// Features of the classifier: form of the plant and the recording, moments of every signal.
std::vector<double> features_of(const CaseFiles& files, int signals) {
  const auto occurrences = [&files](std::string_view word) {
    double count = 0.0;
    for (auto at = files.plant.find(word); at != std::string::npos;
         at = files.plant.find(word, at + 1))
      count += 1.0;
    return count;
  };
  std::vector<double> out = {static_cast<double>(files.recording.rows()),
                             static_cast<double>(files.recording.channels.size()),
                             static_cast<double>(files.recording.events.size()),
                             static_cast<double>(files.recording.meta.size()),
                             static_cast<double>(files.plant.size()),
                             occurrences("[[joint.effect]]")};
  for (const char* id :
       {"compliance", "joint_friction", "coulomb", "viscous", "stribeck", "presliding"})
    out.push_back(occurrences(id));
  for (int c = 0; c < signals; ++c) {
    const bool there = c < static_cast<int>(files.recording.channels.size());
    VectorXd x = there ? VectorXd(files.recording.samples.col(c)) : VectorXd::Zero(2);
    double lost = 0.0;
    for (double& value : x) {
      if (std::isfinite(value)) continue;
      lost += 1.0;
      value = 0.0;
    }
    const double mean = x.mean();
    const double deviation = std::sqrt((x.array() - mean).square().mean()) + 1e-300;
    const auto z = ((x.array() - mean) / deviation).eval();
    for (const double f : {lost, mean, deviation, z.cube().mean(), z.square().square().mean()})
      out.push_back(f);
  }
  return out;
}

}  // namespace

Share classifier_hits(const std::vector<std::vector<double>>& features,
                      const std::vector<int>& labels) {
  const MatrixXd x = ranks(features);
  std::vector<Index> one, other;
  for (std::size_t i = 0; i < labels.size(); ++i)
    (labels[i] != 0 ? one : other).push_back(static_cast<Index>(i));
  Share share;
  for (std::size_t p = 0; p < std::min(one.size(), other.size()); ++p) {
    std::vector<Index> rows;
    for (Index i = 0; i < x.rows(); ++i)
      if (i != one[p] && i != other[p]) rows.push_back(i);
    const MatrixXd seen = x(rows, Eigen::all);
    VectorXd y(seen.rows());
    for (Index i = 0; i < y.size(); ++i)
      y[i] = labels[static_cast<std::size_t>(rows[static_cast<std::size_t>(i)])] != 0 ? 1.0 : -1.0;
    // Ridge in the dual: fewer cases than features.
    MatrixXd kernel = seen * seen.transpose();
    kernel.diagonal().array() += 0.1 * static_cast<double>(x.cols());
    const VectorXd b = seen.transpose() * kernel.ldlt().solve(y);
    const double a = x.row(one[p]).dot(b), c = x.row(other[p]).dot(b);
    // Equal scores are undecided; they alternate, so that they count for one half.
    share.count(a > c || (a == c && p % 2 == 0));
  }
  return share;
}

core::Result<Json> leak_test(const ProofOptions& options, const LeakOptions& leak) {
  const auto count = static_cast<std::size_t>(2 * leak.pairs);
  std::vector<std::vector<double>> features(count);
  std::vector<int> labels(count);
  const auto kinds = vocabulary_kinds();
  const core::Status finished =
      in_parallel(options, count, "{} of {} cases", [&](std::size_t i) -> core::Status {
        CaseOptions case_options;
        case_options.seed = options.seed ^ 0x6c65616bU;
        case_options.duration_s = leak.duration_s;
        case_options.held_out_s = 1.0;
        // By pair: the world that follows a case's number would tell the two of a pair apart.
        case_options.world = options.world != WorldChoice::kBoth ? options.world
                             : i / 2 % 2 == 0                    ? WorldChoice::kOwn
                                                                 : WorldChoice::kOther;
        const SubjectKind& kind = kinds[i / 2 % kinds.size()];
        const bool hidden = i % 2 == 1;
        const CaseDesign design =
            draw_case_with(kind, hidden ? kVanishing : 0.0, static_cast<int>(i), case_options);
        RAVENCAL_ASSIGN_OR_RETURN(CaseFiles files, make_case(design, {}));
        if (hidden && leak.planted) leak.planted(files);
        features[i] = features_of(files, 18);
        labels[i] = hidden ? 1 : 0;
        return {};
      });
  RAVENCAL_RETURN_IF_ERROR(finished);
  const Share share = classifier_hits(features, labels);
  const auto [low, high] = wilson(share);
  return Json{{"schema", 1},
              {"pairs", share.of},
              {"duration_s", leak.duration_s},
              {"accuracy", share.value()},
              {"ci95", {low, high}},
              {"at_chance", low <= 0.5 && high >= 0.5}};
}

}  // namespace ravencal::prove
