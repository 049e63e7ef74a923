// SPDX-License-Identifier: Apache-2.0
#include "diagnose/simulated_command.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>

#include "core/units.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;
using record::Role;

VectorXd signal(const Recording& recording, Role role, const std::string& joint) {
  const auto column = recording.column(role, joint);
  return column ? VectorXd(recording.samples.col(*column)) : VectorXd();
}

/// Share of the command's variance by which two logs of one command may differ. Source: on the
/// twin, sessions of one trajectory, each from a homing of its own, differ by less than a
/// ten-thousandth, and other motions of the same kind by a third and more; this lies between by the
/// same factor.
constexpr double kMostCommandMissed = 0.005;

/// Standard deviation of the finite values; 0 of fewer than two.
double deviation(const VectorXd& x) {
  double sum = 0.0, count = 0.0;
  for (const double value : x) {
    if (!std::isfinite(value)) continue;
    sum += value;
    count += 1.0;
  }
  double squares = 0.0;
  for (const double value : x) {
    if (std::isfinite(value)) squares += std::pow(value - sum / count, 2);
  }
  return count > 1.0 ? std::sqrt(squares / count) : 0.0;
}

}  // namespace

core::Status commanded_alike(const Recording& real, const Recording& aligned) {
  for (const record::Channel& channel : real.channels) {
    if (channel.role != Role::kDesiredPosition) continue;
    const VectorXd desired = signal(real, channel.role, channel.joint);
    const VectorXd other = signal(aligned, channel.role, channel.joint);
    if (other.size() == 0) continue;
    const double apart = deviation(desired - other);
    const double allowed = std::sqrt(kMostCommandMissed) * deviation(desired);
    if (apart <= allowed) continue;
    const core::DisplayUnit unit = core::display_unit(channel.unit);
    return core::data_error(fmt::format(
        "{}: is of another motion than {}: the desired position of joint {} differs by {:.3g} of "
        "{:.3g} {} RMS, and {:.3g} {} is the most; give a simulation of the same motion, in the "
        "order of the recordings",
        aligned.source, real.source, channel.joint, apart * unit.per_si,
        deviation(desired) * unit.per_si, unit.name, allowed * unit.per_si, unit.name));
  }
  return {};
}

}  // namespace ravencal::diagnose
