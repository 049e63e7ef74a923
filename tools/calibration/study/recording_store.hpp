// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/recording.hpp"

namespace ravencal::study {

/// Recordings by path, each read once, for jobs of several threads.
class RecordingStore {
 public:
  explicit RecordingStore(record::LoadOptions load) : load_(std::move(load)) {}
  core::Result<const record::Recording*> get(const std::string& path);

 private:
  struct Entry {
    std::mutex mutex;  ///< held while the recording is read, so that it is read once
    std::optional<record::Recording> recording;
  };
  record::LoadOptions load_;
  std::mutex mutex_;  ///< of entries_
  std::map<std::string, std::unique_ptr<Entry>> entries_;
};

}  // namespace ravencal::study
