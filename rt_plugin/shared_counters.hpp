// SPDX-License-Identifier: Apache-2.0
//
// The counters as any thread may read them: a copy that the real-time thread renews after every
// step, between two increments of a sequence (seqlock), so that what is read belongs together.
#pragma once

#include <cstdint>

#include "ravencal/plugin.h"
#include "rt_plugin/counter_words.hpp"

namespace ravencal::rt {

class SharedCounters {
 public:
  /// [rt]
  void publish(const ravencal_counters& counters) noexcept {
    store_word(sequence_, sequence_ + 1);  // odd: being written
    store_counted(words_.data(), counters);
    store_word(sequence_, sequence_ + 1);
  }

  /// [any] The counters after some step. Tries again while a step writes them, which takes a
  /// fraction of a microsecond; but not for ever, because a debugger may have stopped it there.
  [[nodiscard]] ravencal_counters read() const noexcept {
    constexpr int kAttempts = 100'000;
    ravencal_counters counters{};
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const std::uint64_t before = load_word(sequence_);
      counters = load_record<ravencal_counters>(words_.data());
      if (before % 2 == 0 && load_word(sequence_) == before) break;
    }
    return counters;
  }

 private:
  std::uint64_t sequence_ = 0;
  Words<ravencal_counters> words_{};
};

}  // namespace ravencal::rt
