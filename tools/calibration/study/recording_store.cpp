// SPDX-License-Identifier: Apache-2.0
#include "study/recording_store.hpp"

#include "exchange/load.hpp"
#include "record/plausibility.hpp"

namespace ravencal::study {

core::Result<const record::Recording*> RecordingStore::get(const std::string& path) {
  Entry* entry = nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto& slot = entries_[path];
    if (!slot) slot = std::make_unique<Entry>();
    entry = slot.get();
  }
  const std::lock_guard<std::mutex> lock(entry->mutex);
  if (!entry->recording) {
    RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording, exchange::load_recording(path, load_));
    const auto plausible = record::plausibility_warnings({&recording});
    if (!plausible.ok()) return plausible.error();
    entry->recording = std::move(recording);
  }
  return &*entry->recording;
}

}  // namespace ravencal::study
