// SPDX-License-Identifier: Apache-2.0
//
// How the authors' recorder obtains the truth: a microcontroller reads the external encoders every
// 10 ms or so and prints them, the host stamps the line when it has parsed it, and each robot
// message is paired with the reading of nearest stamp. Late, jittering, never interpolated.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "core/random.hpp"
#include "physics/plant.hpp"

namespace ravencal::simulation {

using EncoderCounts = std::array<std::int64_t, 3>;

class TruthStream {
 public:
  TruthStream(const physics::Logger& logger, std::uint64_t seed);

  /// Shows the encoders at `t_s`, which rises; every control cycle.
  void observe(double t_s, const EncoderCounts& counts);

  /// Reading with the stamp nearest to `t_s`, once a later stamp exists; nullopt before that.
  /// `final` takes the nearest of what there is.
  [[nodiscard]] std::optional<EncoderCounts> nearest(double t_s, bool final) const;

 private:
  struct Reading {
    double stamp_s;
    EncoderCounts counts;
  };

  physics::Logger logger_;
  core::Random random_;
  double next_reading_s_;
  std::deque<Reading> readings_;
};

}  // namespace ravencal::simulation
