// SPDX-License-Identifier: Apache-2.0
//
// Hands a new model from the loading thread to the real-time thread, and the old one back, without
// a lock: two pointers, each exchanged whole. The real-time side never waits and never frees.
#pragma once

#include <atomic>

#include "rt_plugin/loaded_model.hpp"

namespace ravencal::rt {

class ModelSwap {
 public:
  /// [init] Offers `model` to the real-time thread; frees what it gave back or never took.
  void offer(LoadedModel* model) noexcept {
    free_model(retired_.exchange(nullptr, std::memory_order_acquire));
    free_model(offered_.exchange(model, std::memory_order_acq_rel));
  }

  /// [rt] Replaces `current` by the model on offer, if there is one and the last one that was
  /// given back has been collected. Returns true if it did.
  bool take(LoadedModel*& current) noexcept {
    if (offered_.load(std::memory_order_relaxed) == nullptr) return false;
    if (retired_.load(std::memory_order_relaxed) != nullptr) return false;
    LoadedModel* const fresh = offered_.exchange(nullptr, std::memory_order_acquire);
    retired_.store(current, std::memory_order_release);
    current = fresh;
    return true;
  }

  /// [init] Frees whatever is on either side. The real-time thread must have stopped.
  void clear() noexcept {
    free_model(offered_.exchange(nullptr, std::memory_order_acq_rel));
    free_model(retired_.exchange(nullptr, std::memory_order_acq_rel));
  }

 private:
  std::atomic<LoadedModel*> offered_{nullptr};  ///< written by both; non-null: waits to be taken
  std::atomic<LoadedModel*> retired_{nullptr};  ///< written by both; non-null: waits to be freed
};

}  // namespace ravencal::rt
