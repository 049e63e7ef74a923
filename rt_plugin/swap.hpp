// SPDX-License-Identifier: Apache-2.0
//
// Hands new models from the loading thread to the real-time thread, and old ones back, without a
// lock: a slot of one model each way, the way back being the head of a list. Either side exchanges
// whole pointers; the real-time side never waits, retries or frees.
#pragma once

#include <atomic>

#include "rt_plugin/loaded_model.hpp"

namespace ravencal::rt {

class ModelSwap {
 public:
  /// [init] Offers `model` to the real-time thread; frees what it gave back or never took.
  void offer(LoadedModel* model) noexcept {
    free_list(retired_.exchange(nullptr, std::memory_order_acquire));
    free_model(offered_.exchange(model, std::memory_order_acq_rel));
  }

  /// [rt] The model on offer, now the real-time thread's own; null if there is none.
  LoadedModel* take() noexcept {
    if (offered_.load(std::memory_order_relaxed) == nullptr) return nullptr;
    return offered_.exchange(nullptr, std::memory_order_acquire);
  }

  /// [rt] Gives a model back; null is allowed. The loading thread only ever takes the whole list,
  /// and only this thread adds to it: nothing can come between the two lines that matter.
  void retire(LoadedModel* model) noexcept {
    if (model == nullptr) return;
    model->next_retired_ = retired_.exchange(nullptr, std::memory_order_relaxed);
    retired_.store(model, std::memory_order_release);
  }

  /// [init] Frees whatever is on either side. The real-time thread must have stopped.
  void clear() noexcept {
    free_model(offered_.exchange(nullptr, std::memory_order_acq_rel));
    free_list(retired_.exchange(nullptr, std::memory_order_acq_rel));
  }

 private:
  static void free_list(LoadedModel* model) noexcept {
    while (model != nullptr) {
      LoadedModel* const next = model->next_retired_;
      free_model(model);
      model = next;
    }
  }

  std::atomic<LoadedModel*> offered_{nullptr};  ///< written by both; non-null: waits to be taken
  std::atomic<LoadedModel*> retired_{nullptr};  ///< written by both; non-null: wait to be freed
};

}  // namespace ravencal::rt
