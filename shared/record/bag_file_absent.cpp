// SPDX-License-Identifier: Apache-2.0
//
// Built where librosbag_storage is not installed.
#include <fmt/format.h>

#include "record/bag_file.hpp"

namespace ravencal::record {
namespace {

core::Error absent(const std::filesystem::path& path) {
  return {core::ErrorCode::kUsage,
          fmt::format("{}: this build reads and writes no bags; install librosbag-storage-dev and "
                      "build ravencal again",
                      path.string())};
}

}  // namespace

core::Result<std::vector<BagTopic>> bag_topics(const std::filesystem::path& path) {
  return absent(path);
}
core::Status for_each_message(const std::filesystem::path& path, const std::string& /*topic*/,
                              const TakeMessage& /*take*/) {
  return absent(path);
}

struct BagWriter::Impl {};
BagWriter::BagWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;
BagWriter::~BagWriter() = default;
core::Result<BagWriter> BagWriter::create(const std::filesystem::path& path) {
  return absent(path);
}
core::Status BagWriter::write(const std::string& topic, const RosMessageType& /*type*/,
                              std::int64_t /*received_ns*/,
                              std::span<const std::uint8_t> /*bytes*/) {
  return absent(topic);
}
core::Status BagWriter::close() { return {}; }

}  // namespace ravencal::record
