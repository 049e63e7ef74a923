// SPDX-License-Identifier: Apache-2.0
//
// The law that made a recorded command: gains of its own inputs. They come from differences between
// samples, in which a disturbance shows only at its edges, so that a disturbance that is on half of
// the time cannot bend them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnose/series/series.hpp"

namespace ravencal::diagnose {

struct ControlLaw {
  Eigen::Vector3d gains{0.0, 0.0, 0.0};  ///< of position error, measured rate, desired rate
  Eigen::VectorXd residual;              ///< recorded minus law, all rows; level as recorded
  Eigen::Index lag = 1;                  ///< rows between the samples whose differences were fitted
  double explained = 0.0;                ///< share of the squared differences, outliers aside

  /// Of each difference that was fitted, what it asks of the position error's gain, and how much it
  /// asks for per unit by which the gain is too low: nothing in sum, and what it is worth.
  Eigen::VectorXd pull, worth;
};

/// Why a law with this share says nothing of the command.
std::string unexplained(double share);

/// Rows whose command says something of gains: a drive at its limit does not, nor does a held-out
/// row.
std::vector<char> rows_of_law(const Series& series);

/// What may lie in the command beside its law.
enum class Disturbance {
  kNone,
  kPulses,  ///< on for up to half of the time: over half a second they are no outliers
};

/// Law of rows [first, last), by differences between neighbours, or over longer times where these
/// say clearly more: over a tenth of a second where quantisation outweighs the motion between
/// neighbours; beside no disturbance over half a second as well, and where a controller that is
/// faster than the recording saw rates that are not in it.
ControlLaw fit_law(const Series& series, Eigen::Index first, Eigen::Index last, Disturbance beside);

/// Least step between neighbouring commands: the converter's, which cuts all of them alike.
double resolution_of(const Series& series);

}  // namespace ravencal::diagnose
