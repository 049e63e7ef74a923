// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/stretches.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Rows that are fitted, times joints: four minutes of three joints at the working rate.
constexpr double kMostRows = 240.0 * 3.0 * kWorkingRateHz;
/// Cables that creep forget how a stretch began in about half of this.
constexpr double kStretch_s = 40.0;
/// Starts of a stretch are compared in steps of this.
constexpr double kStartStep_s = 1.0;
/// Shares of the motion that differ by rounding alone.
constexpr double kSame = 1e-9;
/// Notes list so many starts.
constexpr std::size_t kMostListed = 12;

struct Stretch {
  Index first = 0, rows = 0;
};

/// Sums from the first row to each row.
VectorXd sums(const VectorXd& x) {
  VectorXd out(x.size() + 1);
  out[0] = 0.0;
  std::partial_sum(x.begin(), x.end(), out.begin() + 1);
  return out;
}

/// How much the joints move between two rows: of each joint the variances of position and velocity,
/// as shares of those of the whole track. Rows that were lost move nothing.
class Motion {
 public:
  explicit Motion(const Track& track) {
    for (std::size_t j = 0; j < track.forced.motors.size(); ++j) {
      VectorXd kept(track.rows());
      for (Index i = 0; i < kept.size(); ++i)
        kept[i] = track.lost[j][static_cast<std::size_t>(i)] != 0 ? 0.0 : 1.0;
      const physics::Motion& motor = track.forced.motors[j];
      for (const VectorXd* signal : {&motor.q, &motor.v}) {
        const VectorXd centred = (signal->array() - signal->mean()).matrix().cwiseProduct(kept);
        const double whole = centred.squaredNorm();
        if (whole > 0.0)
          signals_.push_back(
              {sums(kept), sums(centred / std::sqrt(whole)), sums(centred.cwiseAbs2() / whole)});
      }
    }
  }

  [[nodiscard]] double between(Index first, Index last) const {
    double sum = 0.0;
    for (const Signal& s : signals_) {
      const double rows = s.rows[last] - s.rows[first];
      const double mean = s.values[last] - s.values[first];
      if (rows > 0.0) sum += s.squares[last] - s.squares[first] - mean * mean / rows;
    }
    return sum;
  }

 private:
  struct Signal {
    VectorXd rows, values, squares;
  };
  std::vector<Signal> signals_;
};

std::vector<Stretch> stretches_of(const Track& track, Index rows) {
  const Index usual = std::lround(kStretch_s / track.period_s);
  const Index count = std::max<Index>(1, rows / usual);
  const Index length = rows / count;
  const Index part = track.rows() / count;
  const Index step = std::max<Index>(1, std::lround(kStartStep_s / track.period_s));
  const Motion motion(track);
  std::vector<Stretch> out;
  for (Index k = 0; k < count; ++k) {
    Index best = k * part;
    double most = motion.between(best, best + length);
    for (Index first = best + step; first + length <= (k + 1) * part; first += step) {
      const double moved = motion.between(first, first + length);
      if (moved <= most + kSame) continue;
      most = moved;
      best = first;
    }
    out.push_back({best, length});
  }
  return out;
}

void keep(const std::vector<Stretch>& stretches, Track& track) {
  std::vector<Index> rows;
  for (const Stretch& stretch : stretches) {
    track.forced.fresh[static_cast<std::size_t>(stretch.first)] = 1;
    for (Index i = 0; i < stretch.rows; ++i) rows.push_back(stretch.first + i);
  }
  const auto kept = [rows](const VectorXd& x) { return x.size() > 0 ? VectorXd(x(rows)) : x; };
  const auto cut = [&](VectorXd& x) { x = kept(x); };
  const auto cut_flags = [&](std::vector<char>& flags) {
    std::vector<char> out;
    for (const Index i : rows) out.push_back(flags[static_cast<std::size_t>(i)]);
    flags = std::move(out);
  };
  physics::ForcedMotion& forced = track.forced;
  cut(forced.t_s);
  cut_flags(forced.fresh);
  for (physics::Motion& motor : forced.motors)
    for (VectorXd* x : {&motor.q, &motor.v, &motor.a}) cut(*x);
  for (VectorXd& followed : forced.followed) cut(followed);
  for (VectorXd& load : forced.external_loads) cut(load);
  forced.load = [kept, whole = std::move(forced.load)](const std::string& name) {
    return kept(whole(name));
  };
  for (JointTrack& joint : track.joints)
    for (VectorXd* x :
         {&joint.effort, &joint.truth, &joint.desired, &joint.effort_shift, &joint.truth_shift})
      cut(*x);
  for (std::vector<char>& lost : track.lost) cut_flags(lost);
}

}  // namespace

void keep_moving_stretches(std::vector<Track>& tracks, std::vector<std::string>& notes) {
  double rows = 0.0, whole_s = 0.0, kept_s = 0.0;
  for (const Track& track : tracks)
    rows += static_cast<double>(track.rows()) * static_cast<double>(track.joints.size());
  const double share = kMostRows / rows;
  if (share >= 1.0) return;
  std::vector<std::string> starts;
  for (Track& track : tracks) {
    const auto stretches = stretches_of(
        track, std::max<Index>(1, std::lround(share * static_cast<double>(track.rows()))));
    whole_s += static_cast<double>(track.rows()) * track.period_s;
    for (const Stretch& stretch : stretches) {
      kept_s += static_cast<double>(stretch.rows) * track.period_s;
      starts.push_back(fmt::format("{:.0f}", track.begins_s + track.forced.t_s[stretch.first]));
    }
    keep(stretches, track);
  }
  const std::string where = starts.size() > kMostListed
                                ? ""
                                : fmt::format(", which begin at {} s", fmt::join(starts, ", "));
  notes.push_back(fmt::format(
      "of {:.0f} s to fit, {:.0f} s were fitted: the {} stretches in which the joints move most{} "
      "(--all-rows fits every row)",
      whole_s, kept_s, starts.size(), where));
}

}  // namespace ravencal::diagnose
