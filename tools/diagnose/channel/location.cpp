// SPDX-License-Identifier: Apache-2.0
//
// Where a channel's error exceeds its floor, said before any name: cells of position, direction,
// speed, load and time in which a learner without physics predicts better than the plant does.
#include <algorithm>
#include <cmath>
#include <map>

#include "core/median.hpp"
#include "diagnose/channel/channel.hpp"
#include "diagnose/effects/regimes.hpp"
#include "diagnose/fit/boosted_trees.hpp"
#include "diagnose/fit/derived_seed.hpp"
#include "diagnose/selection/interval_scan.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd features_of(const ChannelModel& model, std::vector<std::string>& names) {
  const auto all = circumstances(*model.series);
  MatrixXd features(model.target.size(), static_cast<Index>(all.size()));
  for (std::size_t f = 0; f < all.size(); ++f) {
    features.col(static_cast<Index>(f)) = model.blocks.gather(all[f].value).col(0);
    names.push_back(all[f].name);
  }
  features.conservativeResize(Eigen::NoChange, features.cols() + 1);
  features.rightCols(1) = model.blocks.gather(model.series->t_s);
  names.emplace_back("time");
  return features;
}

/// Sum of `rows` over each block, only where `in` is set; blocks without such rows are left out.
VectorXd block_sums(const Blocks& blocks, const VectorXd& rows, const std::vector<char>& in) {
  std::vector<double> sums;
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    double sum = 0.0;
    bool any = false;
    for (Index i = blocks.first(b); i < blocks.first(b) + blocks.size(b); ++i) {
      if (in[static_cast<std::size_t>(i)] == 0) continue;
      sum += rows[i];
      any = true;
    }
    if (any) sums.push_back(sum);
  }
  return Eigen::Map<VectorXd>(sums.data(), static_cast<Index>(sums.size()));
}

struct Cell {
  std::string name;
  std::vector<char> in;
  double p_value = 1.0;
  double mean = 0.0;
};

/// Benjamini and Hochberg's step-up at level q.
double discovery_threshold(const std::vector<Cell>& cells, double q) {
  std::vector<double> p;
  for (const Cell& cell : cells) p.push_back(cell.p_value);
  std::sort(p.begin(), p.end());
  double threshold = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i] <= q * static_cast<double>(i + 1) / static_cast<double>(p.size())) threshold = p[i];
  }
  return threshold;
}

Cell make_cell(const ChannelModel& model, std::string name, std::vector<char> in,
               const VectorXd& gain, std::uint64_t seed) {
  Cell cell{std::move(name), std::move(in), 1.0, 0.0};
  double sum = 0.0;
  double count = 0.0;
  for (Index i = 0; i < gain.size(); ++i) {
    if (cell.in[static_cast<std::size_t>(i)] == 0) continue;
    sum += gain[i];
    count += 1.0;
  }
  if (count < 10.0) return cell;
  cell.mean = sum / count;
  cell.p_value =
      cell.mean > 0.0 ? sign_flip_p(block_sums(model.blocks, gain, cell.in), seed, 999) : 1.0;
  return cell;
}

std::vector<char> where(const VectorXd& x, double from, double to) {
  std::vector<char> in(static_cast<std::size_t>(x.size()));
  for (Index i = 0; i < x.size(); ++i)
    in[static_cast<std::size_t>(i)] = x[i] >= from && x[i] <= to ? 1 : 0;
  return in;
}

std::vector<Cell> regime_cells(const ChannelModel& model, const VectorXd& gain,
                               std::uint64_t seed) {
  std::vector<Cell> cells;
  for (const RegimeOf& c : circumstances(*model.series)) {
    if (c.name == "position" || c.name == "memory" || c.name.starts_with("position of")) continue;
    const VectorXd x = model.blocks.gather(c.value).col(0);
    if (c.name == "direction") {
      cells.push_back(make_cell(model, "direction: negative", where(x, -2.0, -0.5), gain, seed));
      cells.push_back(make_cell(model, "direction: positive", where(x, 0.5, 2.0), gain, seed));
      continue;
    }
    const double low = core::upper_quantile(x, 1.0 / 3.0);
    const double high = core::upper_quantile(x, 2.0 / 3.0);
    cells.push_back(make_cell(model, c.name + ": low third", where(x, -1e300, low), gain, seed));
    cells.push_back(make_cell(model, c.name + ": high third", where(x, high, 1e300), gain, seed));
  }
  return cells;
}

/// The plant with its tolerances, no effect and no step taken in, and what it leaves to explain.
class Null {
 public:
  Null(const ChannelFit& fit, const VectorXd& best)
      : blocks_(fit.model.blocks),
        precision_(fit.model.precision.head(static_cast<Index>(1 + fit.nominal->terms.size()))),
        best_(best),
        noise_{best.squaredNorm() / static_cast<double>(best.size()), fit.model.correlation_rows} {
    joined_.resize(best.size(), precision_.size() + 1);
    joined_ << fit.model.free_base.leftCols(precision_.size()), fit.model.free_target;
  }

  /// Stretch of cells; `cell` says in which one each training row lies, of `count`.
  [[nodiscard]] std::optional<std::pair<std::size_t, std::size_t>> stretch(
      const std::vector<std::size_t>& cell, std::size_t count, bool prefer_later) const {
    const Index width = joined_.cols();
    ScanAxis axis{std::vector<MatrixXd>(count, MatrixXd::Zero(width, width)),
                  std::vector<double>(count, 0.0), std::vector<double>(count, 0.0)};
    for (Index i = 0; i < best_.size(); ++i) {
      const std::size_t c = cell[static_cast<std::size_t>(i)];
      axis.moments[c].selfadjointView<Eigen::Lower>().rankUpdate(joined_.row(i).transpose());
      axis.best[c] += best_[i] * best_[i];
      axis.rows[c] += 1.0;
    }
    for (MatrixXd& m : axis.moments) m.triangularView<Eigen::StrictlyUpper>() = m.transpose();
    return scan(axis, precision_, noise_, prefer_later);
  }

  [[nodiscard]] const Blocks& blocks() const { return blocks_; }

 private:
  const Blocks& blocks_;
  VectorXd precision_;
  const VectorXd& best_;
  ScanNoise noise_;
  MatrixXd joined_;
};

/// What the plant leaves at the training rows, each under a fit without its fold: neither effects
/// nor steps are taken in.
VectorXd residual_of_plant(const ChannelFit& fit) {
  if (fit.model.steps.empty()) return fit.base_residual;
  const ChannelModel& model = fit.model;
  const auto own = static_cast<Index>(1 + fit.nominal->terms.size());
  const MatrixXd base = model.base.leftCols(own);
  return held_out_residual(model.blocks, moments_of(model.blocks, base, model.target),
                           model.precision.head(own), base, model.target);
}

std::vector<Interval> positions_of(const Null& null, const VectorXd& q) {
  constexpr std::size_t kCells = 40;
  const double low = q.minCoeff();
  const double width = (q.maxCoeff() - low) / static_cast<double>(kCells);
  if (!(width > 0.0)) return {};
  std::vector<std::size_t> cell;
  for (Index i = 0; i < q.size(); ++i)
    cell.push_back(std::min(kCells - 1, static_cast<std::size_t>((q[i] - low) / width)));
  const auto found = null.stretch(cell, kCells, false);
  if (!found) return {};
  return {{low + static_cast<double>(found->first) * width,
           low + static_cast<double>(found->second + 1) * width}};
}

/// In whole blocks, which are one observation each; a step that was found tells its time better.
std::vector<Interval> times_of(const Null& null, const ChannelFit& fit) {
  const Blocks& blocks = null.blocks();
  const Series& series = *fit.model.series;
  std::vector<std::size_t> cell;
  for (std::size_t b = 0; b < blocks.count(); ++b)
    cell.insert(cell.end(), static_cast<std::size_t>(blocks.size(b)), b);
  auto found = null.stretch(cell, blocks.count(), true);
  if (!found) return {};
  const auto time_at = [&](Index n) {
    return series.t_s[blocks.rows[static_cast<std::size_t>(n)]];
  };
  // Up to a step the recording is as it was calibrated: the mismatch is what comes after.
  for (const Step& step : fit.model.steps) {
    const double from = time_at(blocks.first(found->second));
    const double to = time_at(blocks.begin[found->second + 1] - 1);
    const bool at_step = std::abs(step.t_s - to) <= to - from;
    if (found->first == 0 && found->second + 1 < blocks.count() && at_step)
      found = {found->second, blocks.count() - 1};
  }
  std::vector<Interval> out;
  for (std::size_t b = found->first; b <= found->second; ++b) {
    const double from = time_at(blocks.first(b));
    const double to = time_at(blocks.begin[b + 1] - 1);
    // Recordings each begin at zero.
    if (!out.empty() && from >= out.back().second)
      out.back().second = to;
    else
      out.emplace_back(from, to);
    if (b != found->first || b == 0) continue;
    for (const Step& step : fit.model.steps) {
      if (std::abs(step.t_s - from) <= to - from) out.back().first = step.t_s;
    }
  }
  return out;
}

}  // namespace

void add_remainder(const ChannelFit& fit, const ChannelOptions& options,
                   ChannelFindings& findings) {
  const ChannelModel& model = fit.model;
  std::vector<std::string> names;
  const MatrixXd features = features_of(model, names);
  const HeldOutPrediction rest = boosted_held_out(model.blocks, features, fit.held_out_residual);
  const VectorXd gain = fit.held_out_residual.array().square() -
                        (fit.held_out_residual - rest.value).array().square();
  const auto rows = static_cast<double>(gain.size());
  const double size = std::sqrt(std::max(0.0, gain.sum()) / rows);
  const double left = std::sqrt((fit.held_out_residual - rest.value).squaredNorm() / rows);
  const double p = sign_flip_p(
      block_sums(model.blocks, gain, std::vector<char>(static_cast<std::size_t>(gain.size()), 1)),
      derived_seed(options.seed, "remainder"));
  // A share alone is fooled by the small predictable structure that every simulator's friction
  // leaves: the remainder must also be as large as what is called an effect, in the same place.
  const double share_left = gain.sum() / fit.held_out_residual.squaredNorm();
  const bool predictable =
      gain.sum() > 0.0 && p <= options.gates.alpha && share_left >= 0.2 &&
      size >= std::max(options.gates.unnamed_per_floor * left, least_remainder(fit));
  if (!predictable && fit.unnamed) {
    Unexplained u = *fit.unnamed;
    u.share_of_excess = std::clamp(
        u.share_of_excess * fit.held_out_residual.squaredNorm() / fit.base_residual.squaredNorm(),
        0.0, 1.0);
    findings.unexplained.push_back(std::move(u));
  }
  if (!predictable) return;
  const double excess = fit.base_residual.squaredNorm() - rows * left * left;
  Unexplained u;
  u.joint = findings.joint;
  u.stage = stage_word(findings.stage);
  u.share_of_excess = std::clamp(gain.sum() / std::max(excess, 1e-300), 0.0, 1.0);
  u.size = size;
  u.unit = findings.unit;
  std::vector<std::size_t> order(names.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return rest.importance[a] > rest.importance[b]; });
  for (std::size_t i = 0; i < order.size() && i < 3; ++i) {
    if (rest.importance[order[i]] > 0.1) u.depends_on.push_back(names[order[i]]);
  }
  if (fit.unnamed && std::find(u.depends_on.begin(), u.depends_on.end(),
                               fit.unnamed->depends_on.front()) == u.depends_on.end())
    u.depends_on.insert(u.depends_on.begin(), fit.unnamed->depends_on.front());
  findings.unexplained.push_back(std::move(u));
}

void add_location(const ChannelFit& fit, const ChannelOptions& options, ChannelFindings& findings) {
  const ChannelModel& model = fit.model;
  const auto rows = static_cast<double>(model.target.size());
  std::vector<std::string> names;
  const MatrixXd features = features_of(model, names);
  const VectorXd plain = residual_of_plant(fit);
  const HeldOutPrediction learnt = boosted_held_out(model.blocks, features, plain);
  VectorXd best = plain - learnt.value;
  if (fit.held_out_residual.squaredNorm() < best.squaredNorm()) best = fit.held_out_residual;
  const VectorXd gain = plain.array().square() - best.array().square();
  const std::vector<char> everywhere(static_cast<std::size_t>(gain.size()), 1);
  Mismatch m;
  m.joint = findings.joint;
  m.stage = stage_word(findings.stage);
  m.unit = findings.unit;
  m.p_value = sign_flip_p(block_sums(model.blocks, gain, everywhere),
                          derived_seed(options.seed, "location"));
  m.floor = std::sqrt(best.squaredNorm() / rows);
  double offset2 = 0.0;
  for (const NamedEffect& effect : findings.effects) {
    if (traits_of(effect.id).constant) offset2 = effect.size * effect.size;
  }
  m.excess_rmse = std::sqrt(std::max(0.0, gain.sum() / rows) + offset2);
  const bool found = !findings.effects.empty() || !findings.unexplained.empty();
  const bool exceeds =
      m.p_value <= options.gates.alpha && m.excess_rmse >= options.gates.size_per_floor * m.floor;
  if (!found && !exceeds) return;
  if (gain.sum() > 0.0) {
    auto cells = regime_cells(model, gain, derived_seed(options.seed, "regimes"));
    const double threshold = discovery_threshold(cells, 0.05);
    for (const Cell& cell : cells) {
      if (cell.p_value <= threshold && cell.mean > 1.5 * gain.mean()) m.regime.push_back(cell.name);
    }
    const Null null(fit, best);
    m.position = positions_of(null, model.blocks.gather(model.series->motion.q).col(0));
    m.interval_s = times_of(null, fit);
  }
  if (m.regime.empty()) m.regime.emplace_back("everywhere");
  findings.mismatch.push_back(std::move(m));
}

}  // namespace ravencal::diagnose
