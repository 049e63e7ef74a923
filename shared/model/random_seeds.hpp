// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace ravencal::model {

/// The seeds of one recording that `ravencal simulate` made. Recordings of equal run seeds wander
/// alike, and those of equal homing have the same constant error, whatever the motion is.
struct RandomSeeds {
  std::string recording;        ///< name of its file
  std::uint64_t run = 0;        ///< `--seed`: wander of the cables, noise of the encoders
  std::uint64_t homing = 0;     ///< `--homing-seed`: power-on and the zeros that homing finds
  std::uint64_t rehomings = 0;  ///< `--rehomings`: homings before the recording began
  bool operator==(const RandomSeeds&) const = default;
};

}  // namespace ravencal::model
