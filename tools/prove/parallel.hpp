// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include "core/result.hpp"
#include "core/run_tasks.hpp"
#include "prove/proof.hpp"

namespace ravencal::prove {

/// Runs work(i), which gives a Status, for i in [0, count) on options.jobs threads. `words` tell
/// options.look how many of how many are done. The first failure stops the others after their
/// present item and is returned; so does a look that says stop (kUsage).
template <typename Work>
core::Status in_parallel(const ProofOptions& options, std::size_t count, const char* words,
                         Work&& work) {
  const core::Error stopped{core::ErrorCode::kUsage, "stopped; the same command continues"};
  bool told_to_stop = false;
  RAVENCAL_ASSIGN_OR_RETURN(
      const core::TasksDone done,
      core::run_tasks(
          count, options.jobs,
          [&](std::size_t i, const auto&) -> core::Result<bool> {
            RAVENCAL_RETURN_IF_ERROR(work(i));
            return true;
          },
          [&](double share, std::size_t finished, std::size_t) {
            told_to_stop = options.look &&
                           !options.look(share, fmt::format(fmt::runtime(words), finished, count));
            return !told_to_stop;
          }));
  if (told_to_stop || done.interrupted) return stopped;
  return {};
}

}  // namespace ravencal::prove
