// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/simulated_recording.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "core/units.hpp"
#include "diagnose/track/input.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;
using record::Role;

/// Share of the command's variance by which two logs of one command may differ. Source: on the
/// twin, sessions of one trajectory, each from a homing of its own, differ by less than a
/// ten-thousandth, and other motions of the same kind by a third and more; this lies between by the
/// same factor.
constexpr double kMostCommandMissed = 0.005;

/// Simulators often count from zero: stamps that nowhere overlap count from each start.
std::int64_t shift_ns(const Recording& real, const Recording& simulated) {
  const bool overlap =
      simulated.t_ns.front() < real.t_ns.back() && real.t_ns.front() < simulated.t_ns.back();
  return overlap ? 0 : simulated.t_ns.front() - real.t_ns.front();
}

/// Fills the samples of `out`, and says how many rows the simulation covers.
Index interpolate(const Recording& simulated, std::int64_t shift, Recording& out) {
  std::size_t after = 1;
  Index covered = 0;
  for (Index i = 0; i < out.rows(); ++i) {
    const std::int64_t t = out.t_ns[static_cast<std::size_t>(i)] + shift;
    while (after + 1 < simulated.t_ns.size() && simulated.t_ns[after] < t) ++after;
    const std::int64_t t0 = simulated.t_ns[after - 1];
    const std::int64_t t1 = simulated.t_ns[after];
    if (t < t0 || t > t1) continue;
    const double share = t1 > t0 ? static_cast<double>(t - t0) / static_cast<double>(t1 - t0) : 0.0;
    const auto row = static_cast<Index>(after);
    out.samples.row(i) =
        (1.0 - share) * simulated.samples.row(row - 1) + share * simulated.samples.row(row);
    ++covered;
  }
  return covered;
}

/// Standard deviation of the finite values; 0 of fewer than two.
double deviation_of(const VectorXd& x) {
  const auto finite = x.array().isFinite();
  const double count = finite.cast<double>().sum();
  if (count < 2.0) return 0.0;
  const double mean = finite.select(x.array(), 0.0).sum() / count;
  return std::sqrt(finite.select((x.array() - mean).square(), 0.0).sum() / count);
}

core::Status commanded_like(const Recording& real, const Recording& aligned) {
  for (const record::Channel& channel : real.channels) {
    if (channel.role != Role::kDesiredPosition) continue;
    const auto own = real.column(channel.role, channel.joint);
    const auto other = aligned.column(channel.role, channel.joint);
    if (!other) continue;
    const VectorXd desired = real.samples.col(*own);
    const double apart = deviation_of(desired - aligned.samples.col(*other));
    const double allowed = std::sqrt(kMostCommandMissed) * deviation_of(desired);
    if (apart <= allowed) continue;
    const core::DisplayUnit unit = core::display_unit(channel.unit);
    return core::data_error(fmt::format(
        "{}: is of another motion than {}: the desired position of joint {} differs by {:.3g} of "
        "{:.3g} {} RMS, and {:.3g} {} is the most; give a simulation of the same motion, in the "
        "order of the recordings",
        aligned.source, real.source, channel.joint, apart * unit.per_si,
        deviation_of(desired) * unit.per_si, unit.name, allowed * unit.per_si, unit.name));
  }
  return {};
}

}  // namespace

core::Result<Recording> simulated_recording(const Recording& real, const Recording& simulated,
                                            std::vector<std::string>& notes) {
  if (simulated.rows() < 2 || real.rows() < 1) {
    return core::data_error(
        fmt::format("{}: too few rows to stand for {}", simulated.source, real.source));
  }
  Recording out;
  out.channels = simulated.channels;
  out.events = real.events;
  out.t_ns = real.t_ns;
  out.source = simulated.source;
  out.samples.setConstant(real.rows(), simulated.samples.cols(),
                          std::numeric_limits<double>::quiet_NaN());
  const std::int64_t shift = shift_ns(real, simulated);
  if (shift != 0)
    notes.push_back(fmt::format(
        "the times of {} and {} nowhere overlap, so that each counts from its own start",
        file_name(simulated), file_name(real)));
  const Index covered = interpolate(simulated, shift, out);
  const auto covers = [&](const std::string& what) {
    return fmt::format("covers {} of {} rows of {}", covered, real.rows(), what);
  };
  if (covered * 2 < real.rows()) {
    return core::data_error(fmt::format(
        "{}: {}; give a simulation of the same motion or command, in the order of the recordings",
        simulated.source, covers(real.source)));
  }
  if (covered < real.rows())
    notes.push_back(fmt::format("{} {}; the others are not looked at", file_name(simulated),
                                covers(file_name(real))));
  RAVENCAL_RETURN_IF_ERROR(commanded_like(real, out));
  return out;
}

}  // namespace ravencal::diagnose
