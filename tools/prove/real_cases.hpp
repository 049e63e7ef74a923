// SPDX-License-Identifier: Apache-2.0
//
// Cases from real recordings. Ablated: the plant lacks a term that the real robot has; diagnose
// should find its name and the published value. Injected: a known effect is added to the motion and
// noise of a real recording.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "prove/generator/case.hpp"

namespace ravencal::prove {

struct RealCase {
  std::string track;           ///< "ablated" or "injected"
  std::string set, recording;  ///< folder and file below the data; profile and plant are `set`.toml
  std::string plant_addition;  ///< effects that the plant keeps; TOML, of its last joint
  std::string id, joint, from, stage;
  std::string parameter;  ///< as reported; empty: no published value
  double value = 0.0;     ///< at the joint: published (ablated) or added (injected)
  double order = 0.0;     ///< of an injected wave, per joint unit
  std::string source;     ///< whose value it is
  /// Injected: what one unit of `value` adds, from the positions of the joint and of joint `from`.
  Eigen::VectorXd (*form)(const RealCase&, const Eigen::VectorXd& q,
                          const Eigen::VectorXd& other) = nullptr;
  Intervals (*interval_s)(const record::Recording&) = nullptr;  ///< where it acts, if local
  double per_recorded = 1.0;  ///< injected: joint's units over those of the recorded channel
};

const std::vector<RealCase>& real_cases();

/// Where the folder lacks recordings that the cases need: says which. Errors: kIo.
core::Status have_real_recordings(const std::filesystem::path& data,
                                  const std::filesystem::path& house);

/// Errors: kIo or kData where recording, profile or plant cannot be read.
core::Result<CaseFiles> make_real_case(const RealCase& real, const std::filesystem::path& data,
                                       const std::filesystem::path& house, std::uint64_t seed);

}  // namespace ravencal::prove
