// SPDX-License-Identifier: Apache-2.0
//
// Where a parameter stands in a state. Each returns what writes its value there.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "diagnose/model/parameter.hpp"
#include "diagnose/model/state.hpp"
#include "diagnose/vocabulary/scales.hpp"

namespace ravencal::diagnose {

using Setter = std::function<void(State&, double value)>;

/// A parameter of an effect of the joint.
Setter in_plant(std::size_t joint, std::string effect, std::string parameter,
                std::string from = "");
/// The stiffness of the cable, as its compliance; 0: it does not stretch.
Setter as_compliance(std::size_t joint);
/// The sine (part 0) or the cosine (1) of an effect that a plant has as amplitude and phase.
Setter as_wave(std::size_t joint, std::string effect, std::size_t part);

/// Where a point is along a direction, from where the plant has it; what it is across stays.
/// `point`: of a joint.
template <typename Point>
Setter along(std::size_t joint, const Eigen::Vector3d& direction, const Eigen::Vector3d& given,
             Point point) {
  return [=](State& state, double value) {
    std::array<double, 3>& place = point(state.plant.joints[joint]);
    const Eigen::Map<Eigen::Vector3d> now(place.data());
    const Eigen::Vector3d moved = now + (value - direction.dot(now - given)) * direction;
    place = {moved.x(), moved.y(), moved.z()};
  };
}

/// A member of the circumstances of one joint, in one recording or in all.
template <typename Member>
Setter in_circumstances(std::size_t joint, std::optional<std::size_t> recording, Member member) {
  return [=](State& state, double value) {
    for (std::size_t r = 0; r < state.circumstances.size(); ++r)
      if (!recording || *recording == r) std::invoke(member, state.circumstances[r][joint]) = value;
  };
}

/// A parameter of an effect of the joint where a plant has it; its value and prior are still open.
Parameter parameter_of(const Scales& scales, const std::string& effect, const std::string& name,
                       Reaches reaches, const std::string& from = "");

}  // namespace ravencal::diagnose
