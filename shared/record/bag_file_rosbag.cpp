// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "record/bag_file.hpp"
#include "record/ros_raw_message.hpp"

namespace ravencal::record {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::uint32_t kLargestMessage = 1U << 26U;  // raven_state has 980 bytes

ros::Time time_of(std::int64_t t_ns) {
  // A bag holds no message at time zero.
  const std::int64_t t = std::max<std::int64_t>(1, t_ns);
  return {static_cast<std::uint32_t>(t / kSecondNs), static_cast<std::uint32_t>(t % kSecondNs)};
}

std::int64_t ns_of(const ros::Time& time) {
  return std::int64_t{time.sec} * kSecondNs + std::int64_t{time.nsec};
}

core::Error bad_bag(const fs::path& path, std::string_view why) {
  return {core::ErrorCode::kData,
          fmt::format("{}: cannot be read as a bag: {}; it is damaged or cut off, or its recorder "
                      "was killed (`rosbag reindex` may save what is there)",
                      path.string(), why)};
}

/// Runs what may throw in the library's code.
template <typename Work>
core::Status guarded(const fs::path& path, Work&& work) {
  try {
    return work();
  } catch (const std::exception& error) {
    return bad_bag(path, error.what());
  }
}

}  // namespace

struct BagReader::Impl {
  fs::path path;
  rosbag::Bag bag;
  std::vector<BagTopic> topics;
};

BagReader::BagReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BagReader::BagReader(BagReader&&) noexcept = default;
BagReader& BagReader::operator=(BagReader&&) noexcept = default;
BagReader::~BagReader() = default;

core::Result<BagReader> BagReader::open(const fs::path& path) {
  std::error_code failure;
  if (!fs::is_regular_file(path, failure)) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: no such file", path.string())};
  }
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  const core::Status status = guarded(path, [&]() -> core::Status {
    impl->bag.open(path.string(), rosbag::bagmode::Read);
    rosbag::View view(impl->bag);
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
      const BagTopic topic{connection->topic, connection->datatype, connection->md5sum};
      const bool known =
          std::any_of(impl->topics.begin(), impl->topics.end(), [&](const BagTopic& other) {
            return other.name == topic.name && other.md5 == topic.md5;
          });
      if (!known) impl->topics.push_back(topic);
    }
    return {};
  });
  if (!status.ok()) return status.error();
  return BagReader(std::move(impl));
}

const std::vector<BagTopic>& BagReader::topics() const { return impl_->topics; }

core::Status BagReader::for_each(const std::string& topic, const Take& take) {
  return guarded(impl_->path, [&]() -> core::Status {
    rosbag::View view(impl_->bag, rosbag::TopicQuery(topic));
    std::vector<std::uint8_t> bytes;
    for (const rosbag::MessageInstance& message : view) {
      const std::uint32_t size = message.size();
      if (size > kLargestMessage)
        return bad_bag(impl_->path, fmt::format("{}: a message of {} bytes", topic, size));
      bytes.resize(size);
      ros::serialization::OStream stream(bytes.data(), size);
      message.write(stream);
      RAVENCAL_RETURN_IF_ERROR(take(ns_of(message.getTime()), bytes));
    }
    return {};
  });
}

struct BagWriter::Impl {
  fs::path path;
  rosbag::Bag bag;
};

BagWriter::BagWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;
BagWriter::~BagWriter() = default;

core::Result<BagWriter> BagWriter::create(const fs::path& path) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  const core::Status status = guarded(path, [&]() -> core::Status {
    impl->bag.open(path.string(), rosbag::bagmode::Write);
    return {};
  });
  if (!status.ok()) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot be written", path.string())};
  }
  return BagWriter(std::move(impl));
}

core::Status BagWriter::write(const std::string& topic, const RosMessageType& type,
                              std::int64_t received_ns, std::span<const std::uint8_t> bytes) {
  return guarded(impl_->path, [&]() -> core::Status {
    const RosRawMessage message{&type, {bytes.begin(), bytes.end()}};
    impl_->bag.write(topic, time_of(received_ns), message);
    return {};
  });
}

core::Status BagWriter::close() {
  return guarded(impl_->path, [&]() -> core::Status {
    impl_->bag.close();
    return {};
  });
}

}  // namespace ravencal::record
