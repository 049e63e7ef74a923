// SPDX-License-Identifier: Apache-2.0
//
// ROS 1 bags as messages of bytes, through librosbag_storage. A build without that library has the
// same functions, and each says which package is missing. The library trusts the bytes of a bag, so
// that a child process reads each. Private to record/; one thread per file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/raven_state_message.hpp"

namespace ravencal::record {

struct BagTopic {
  std::string name;  ///< e.g. "/ravenstate"
  std::string type;  ///< e.g. "raven_2/raven_state"
  std::string md5;
};

/// The topics of a bag. Errors: no such file, no bag, not closed or cut off (it then has no index).
core::Result<std::vector<BagTopic>> bag_topics(const std::filesystem::path& path);

/// Calls `take` for every message of a topic in the order in which they were received, until it
/// returns an error. `received_ns` is the recorder's time, not the message's own.
using TakeMessage =
    std::function<core::Status(std::int64_t received_ns, std::span<const std::uint8_t> bytes)>;
core::Status for_each_message(const std::filesystem::path& path, const std::string& topic,
                              const TakeMessage& take);

/// A bag that appears under its name when it is closed, whole; before that, what had the name
/// stays.
class BagWriter {
 public:
  static core::Result<BagWriter> create(const std::filesystem::path& path);
  BagWriter(BagWriter&&) noexcept;
  BagWriter& operator=(BagWriter&&) noexcept;
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;
  ~BagWriter();

  core::Status write(const std::string& topic, const RosMessageType& type, std::int64_t received_ns,
                     std::span<const std::uint8_t> bytes);
  /// Writes the index, without which the file is no bag, and gives the bag its name.
  core::Status close();

 private:
  struct Impl;
  explicit BagWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::record
