// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "diagnose/vocabulary/scales.hpp"
#include "diagnose/vocabulary/vocabulary.hpp"

namespace ravencal::diagnose {

/// Until its prior opens, a number that may be wrong ends where it would be called wrong: what is
/// missing must not hide in it.
void close(Parameter& number);

/// The numbers of one joint that are always fitted: those of the plant within their tolerance, and
/// what every recording has of its own.
void add_numbers(const physics::Plant& plant, const Scales& scales, std::size_t recordings,
                 std::vector<Parameter>& numbers);

/// Effects that one joint's plant may lack, and numbers of it that may be wrong. `scales`: of all
/// joints.
void add_effects(const physics::Plant& plant, const std::vector<Scales>& scales, std::size_t joint,
                 std::size_t recordings, std::vector<Candidate>& candidates);
void add_wrong_numbers(const physics::Plant& plant, const Scales& scales,
                       const std::vector<Parameter>& numbers, std::vector<Candidate>& candidates);
/// Where the joint stands in its carrier and where it reads zero, where the plant states a
/// tolerance: efforts tell links that weigh otherwise from links that are longer by little, so that
/// what no one doubts is exact.
void add_geometry(const physics::Plant& plant, const Scales& scales,
                  std::vector<Parameter>& numbers, std::vector<Candidate>& candidates);
/// Where links of plants with frames have their centres of mass: in those directions in which the
/// efforts of these recordings change by it.
void add_centres(const physics::Plant& plant, const std::vector<Scales>& scales,
                 const Likelihood& training, std::vector<Parameter>& numbers);
/// A weight on the tool, which all joints feel.
void add_payload(const physics::Plant& plant, const std::vector<Scales>& scales,
                 std::vector<Candidate>& candidates);

/// Shapes that no plant can have: each in one channel, over what it may depend on.
void add_shapes(const Scales& scales, Likelihood& training, Likelihood* held_out,
                std::vector<Candidate>& candidates);

}  // namespace ravencal::diagnose
