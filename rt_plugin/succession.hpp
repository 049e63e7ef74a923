// SPDX-License-Identifier: Apache-2.0
//
// Which weights run. New ones first fill their memory of past cycles beside those in use, then
// replace them; the ones before are kept until the new ones have proven themselves, and return if
// the new ones give a result that is not finite. Real-time thread only; old weights go back through
// the swap and are freed elsewhere.
#pragma once

#include <cstdint>

#include "rt_plugin/loaded_model.hpp"
#include "rt_plugin/swap.hpp"

namespace ravencal::rt {

class Succession {
 public:
  /// Cycles without a doubt after which new weights have proven themselves.
  static constexpr std::uint32_t kProvingTicks = 1000;

  explicit Succession(ModelSwap& swap) noexcept : swap_(&swap) {}

  [[nodiscard]] LoadedModel* current() const noexcept { return current_; }

  /// Start of a cycle: takes what is on offer, and shows the cycle to the weights in use and to
  /// those that wait. Returns true if other weights are in use now.
  bool advance(const CycleView& cycle) noexcept {
    if (LoadedModel* const fresh = swap_->take(); fresh != nullptr) {
      swap_->retire(candidate_);
      candidate_ = fresh;
    }
    if (candidate_ != nullptr) {
      candidate_->observe(cycle);
      if (current_ == nullptr || !candidate_->is_warming_up()) {
        adopt_candidate();
        return true;
      }
    }
    if (current_ != nullptr) current_->observe(cycle);
    return false;
  }

  void forget_history() noexcept {
    if (current_ != nullptr) current_->forget_history();
    if (candidate_ != nullptr) candidate_->forget_history();
  }

  /// The weights in use came through a cycle without any doubt.
  void note_sound_cycle() noexcept {
    if (before_ == nullptr || ++sound_ticks_ < kProvingTicks) return;
    swap_->retire(before_);
    before_ = nullptr;
  }

  /// The weights in use are at fault. Returns to the ones before, if these have not proven
  /// themselves; false if there is nothing to return to.
  bool roll_back() noexcept {
    failed_ = before_ == nullptr;
    if (failed_) return false;
    swap_->retire(current_);
    current_ = before_;
    before_ = nullptr;
    current_->forget_history();  // it was not shown the cycles between
    return true;
  }

  /// [init] Frees everything. The real-time thread must have stopped.
  void clear() noexcept {
    for (LoadedModel* const model : {current_, before_, candidate_}) free_model(model);
    current_ = before_ = candidate_ = nullptr;
  }

 private:
  /// Of two that have not proven themselves, the older one goes, not the proven one before it; one
  /// that failed is never kept.
  void adopt_candidate() noexcept {
    const bool keep = before_ == nullptr && !failed_;
    if (keep) {
      before_ = current_;
    } else {
      swap_->retire(current_);
    }
    current_ = candidate_;
    candidate_ = nullptr;
    sound_ticks_ = 0;
    failed_ = false;
  }

  ModelSwap* swap_;
  LoadedModel* current_ = nullptr;
  LoadedModel* before_ = nullptr;     ///< until current_ has proven itself
  LoadedModel* candidate_ = nullptr;  ///< until its memory of past cycles is full
  std::uint32_t sound_ticks_ = 0;
  bool failed_ = false;  ///< current_ is at fault, and nothing is left to return to
};

}  // namespace ravencal::rt
