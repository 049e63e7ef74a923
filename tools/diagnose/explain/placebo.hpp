// SPDX-License-Identifier: Apache-2.0
//
// How often the search names something in recordings in which nothing is left out.
#pragma once

#include <cstdint>
#include <functional>

#include "diagnose/explain/models.hpp"

namespace ravencal::diagnose {

/// Share of `placebos` in which the search finds anything. A placebo has the motion of the training
/// recordings, what the given plant with its refitted numbers predicts, and the innovations of the
/// best model, whose signs are drawn anew for each block. `go_on`: told the share that is done;
/// false ends it.
double false_alarm_rate(const Models& models, int placebos, std::uint64_t seed,
                        const std::function<bool(double share)>& go_on);

}  // namespace ravencal::diagnose
