// SPDX-License-Identifier: Apache-2.0
//
// Where links have their centres of mass, and a payload. What a link weighs is a line of
// numbers.cpp.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "diagnose/findings/policy.hpp"
#include "diagnose/vocabulary/candidates.hpp"
#include "diagnose/vocabulary/setters.hpp"
#include "physics/tolerance_keys.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr const char* kCentreId = "centre_of_mass";
/// Along the joint's axis, away from it, and across both.
constexpr std::array<const char*, 3> kCentreNames = {"axial", "radial", "tangential"};
/// Size at which a centre that may be wrong is tried, m.
constexpr double kCentreStart_m = 0.03;
/// A change of a joint's effort, over the RMS of its efforts, that two integrators of the same
/// equations differ by: one that is smaller moves nothing.
constexpr double kUnmoved = 1e-3;
/// Distances below are none, m.
constexpr double kNoDistance_m = 1e-6;
/// Of a payload's centre of mass from where the plant hangs payloads: a tool's size.
constexpr double kPayloadPlaceDeviation_m = 0.15;
constexpr double kPayloadPlaceStep_m = 0.005;
/// Mass at which a payload is tried, and the least share of it that is one.
constexpr double kPayloadStart_kg = 0.1;
constexpr double kLeastPayload = 0.002;

/// Orthonormal, in the link's frame; they do not depend on how its axes were laid.
std::array<Vector3d, 3> centre_directions(const physics::Joint& joint) {
  const Vector3d axis = Eigen::Map<const Vector3d>(joint.frame->axis.data());
  const Vector3d centre = Eigen::Map<const Vector3d>(joint.link.com_m.data());
  Vector3d radial = centre - axis.dot(centre) * axis;
  if (radial.norm() < kNoDistance_m) radial = axis.unitOrthogonal();
  radial.normalize();
  return {axis, radial, axis.cross(radial)};
}

/// Whether a change of the plant changes an effort that was recorded.
bool moves_an_effort(const physics::Plant& given, const physics::Plant& changed,
                     const std::vector<Scales>& scales, const Likelihood& training) {
  for (const Scales& s : scales) {
    if (!s.effort) continue;
    double squares = 0.0, rows = 0.0;
    for (std::size_t r = 0; r < training.tracks().size(); ++r) {
      const physics::Predictor& predictor = training.predictor(r);
      const VectorXd change =
          predictor.link_load(changed, s.joint) - predictor.link_load(given, s.joint);
      squares += change.squaredNorm();
      rows += static_cast<double>(change.size());
    }
    if (std::sqrt(squares / rows) > kUnmoved * s.load) return true;
  }
  return false;
}

}  // namespace

void add_centres(const physics::Plant& plant, const std::vector<Scales>& scales,
                 const Likelihood& training, std::vector<Parameter>& numbers) {
  for (const Scales& s : scales) {
    const physics::Joint& joint = plant.joints[s.joint];
    if (!joint.frame || joint.link.mass_kg <= 0.0) continue;
    const double tolerance_m =
        physics::stated_tolerance(joint, kCentreId, "").value_or(physics::kUnstatedCentre_m);
    const Vector3d given = Eigen::Map<const Vector3d>(joint.link.com_m.data());
    const std::array<Vector3d, 3> directions = centre_directions(joint);
    for (std::size_t d = 0; d < directions.size(); ++d) {
      Parameter p = parameter_of(s, kCentreId, kCentreNames[d], Reaches::kLinkLoad);
      p.unit = "m";
      p.scale = kCentreStart_m;
      p.deviation = kDeviationPerTolerance * tolerance_m / p.scale;
      p.step = 0.5 * p.deviation;
      p.set = along(
          s.joint, directions[d], given, [](auto& of) -> auto& { return of.link.com_m; });
      State state{plant, {}, {}, {}};
      p.set(state, kWrongBy * p.deviation * p.scale);
      if (moves_an_effort(plant, state.plant, scales, training)) numbers.push_back(std::move(p));
    }
  }
}

void add_payload(const physics::Plant& plant, const std::vector<Scales>& scales,
                 std::vector<Candidate>& candidates) {
  const Scales& s = scales.back();
  Candidate& c = candidates.emplace_back();
  c.id = "payload";
  c.joint = s.joint;
  Parameter mass = parameter_of(s, c.id, "mass", Reaches::kLinkLoad);
  mass.unit = "kg";
  mass.scale = kPayloadStart_kg;
  mass.deviation = kUnknownSize;
  mass.step = 1.0;
  mass.low = kLeastPayload;
  mass.set = [given_kg = plant.payload.mass_kg](State& state, double value) {
    state.plant.payload.mass_kg = given_kg + value;
  };
  c.sizes = {std::move(mass)};
  // One joint feels the product of mass and lever alone.
  if (!plant.joints.back().frame || plant.joints.size() == 1) return;
  constexpr std::array<const char*, 3> kPlaceNames = {"place_x", "place_y", "place_z"};
  for (std::size_t i = 0; i < kPlaceNames.size(); ++i) {
    Parameter place = parameter_of(s, c.id, kPlaceNames[i], Reaches::kLinkLoad);
    place.unit = "m";
    place.deviation = kPayloadPlaceDeviation_m;
    place.step = kPayloadPlaceStep_m;
    place.set = [i](State& state, double value) { state.plant.payload.com_m[i] = value; };
    c.forms.push_back(std::move(place));
  }
  const std::array<double, 3>& at = plant.payload.com_m;
  c.starts = {{at[0], at[1], at[2]}};
}

}  // namespace ravencal::diagnose
