// SPDX-License-Identifier: Apache-2.0
//
// ROS 1 bags as messages of bytes, through librosbag_storage. A build without that library has the
// same functions, and each says which package is missing. The library finds files that are cut off,
// but trusts the bytes of a whole one: read bags of known origin. Private to record/; one thread
// per file.
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

class BagReader {
 public:
  /// Errors: no such file, no bag, not closed or cut off (it then has no index).
  static core::Result<BagReader> open(const std::filesystem::path& path);
  BagReader(BagReader&&) noexcept;
  BagReader& operator=(BagReader&&) noexcept;
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;
  ~BagReader();

  [[nodiscard]] const std::vector<BagTopic>& topics() const;

  /// Calls `take` for every message of a topic in the order in which they were received, until it
  /// returns an error. `received_ns` is the recorder's time, not the message's own.
  using Take =
      std::function<core::Status(std::int64_t received_ns, std::span<const std::uint8_t> bytes)>;
  core::Status for_each(const std::string& topic, const Take& take);

 private:
  struct Impl;
  explicit BagReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

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
  /// Writes the index, without which the file is no bag.
  core::Status close();

 private:
  struct Impl;
  explicit BagWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::record
