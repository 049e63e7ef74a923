// SPDX-License-Identifier: Apache-2.0
//
// The report at a glance: one sentence per joint, and where along its chain the error is.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "diagnose/findings/findings.hpp"
#include "diagnose/report/causes.hpp"

namespace ravencal::diagnose {

inline constexpr std::array<std::string_view, 5> kChain = {"command", "drive", "transmission",
                                                           "joint", "sensor"};

/// A stage of a joint. Shares are of the plant's squared held-out error: what lies above the floor.
struct ChainCell {
  std::string joint, stage;
  const HeldOut* figure = nullptr;  ///< of the report; null: the stage has none of its own
  double share_before = 0.0, share_after = 0.0;
  std::vector<std::string> effects;  ///< ids found there
  std::string without_figure;        ///< why there is none
};

/// Every stage of every joint, in the plant's order of joints.
std::vector<ChainCell> chain_of(const Report& report, const std::vector<Cause>& causes);

struct JointLine {
  std::string joint, sentence;
  const HeldOut* figure = nullptr;  ///< the one that stands for the joint; null: none
};

/// Every joint that was looked at or could not be.
std::vector<JointLine> joint_lines(const Report& report, const std::vector<Cause>& causes);

/// One sentence for the kind of verdict.
std::string headline(const Verdict& verdict);

}  // namespace ravencal::diagnose
