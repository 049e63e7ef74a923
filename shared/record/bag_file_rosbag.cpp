// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <new>
#include <utility>

#include "core/isolated.hpp"
#include "core/whole_file.hpp"
#include "record/bag_file.hpp"
#include "record/ros_bytes.hpp"
#include "record/ros_raw_message.hpp"

namespace ravencal::record {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::uint32_t kLargestMessage = 1U << 20U;  // raven_state has 980 bytes

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

core::Error unwritten(const fs::path& path, std::string_view why) {
  return {core::ErrorCode::kIo,
          fmt::format("{}: cannot be written: {}; choose a folder that exists, is writable and has "
                      "room",
                      path.string(), why)};
}

/// Runs what may throw in the library's code.
template <typename Work>
core::Status guarded(const fs::path& path, const Work& work,
                     core::Error (*error_of)(const fs::path&, std::string_view)) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    return error_of(path, error.what());
  }
}

core::Status read_bag(const fs::path& path,
                      const std::function<core::Status(rosbag::Bag&, const core::TakePiece&)>& read,
                      const core::TakePiece& take) {
  std::error_code failure;
  if (!fs::is_regular_file(path, failure)) {
    return core::io_error(fmt::format("{}: no such file", path.string()));
  }
  const auto in_library = [&](const core::TakePiece& send) {
    const auto work = [&] {
      rosbag::Bag bag(path.string(), rosbag::bagmode::Read);
      return read(bag, send);
    };
    return guarded(path, work, bad_bag);
  };
  return core::in_child(path, "read as a bag", core::Isolation::reading(path), in_library, take);
}

core::Status send_topics(rosbag::Bag& bag, const core::TakePiece& send) {
  rosbag::View view(bag);
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    RosWriter piece;
    piece.text(connection->topic);
    piece.text(connection->datatype);
    piece.text(connection->md5sum);
    RAVENCAL_RETURN_IF_ERROR(send(piece.take()));
  }
  return {};
}

core::Status send_messages(rosbag::Bag& bag, const fs::path& path, const std::string& topic,
                           const core::TakePiece& send) {
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  std::vector<std::uint8_t> piece;
  for (const rosbag::MessageInstance& message : view) {
    const std::uint32_t size = message.size();
    if (size > kLargestMessage)
      return bad_bag(path, fmt::format("{}: a message of {} bytes", topic, size));
    const std::int64_t received_ns = ns_of(message.getTime());
    piece.resize(sizeof received_ns + size);
    std::memcpy(piece.data(), &received_ns, sizeof received_ns);
    ros::serialization::OStream stream(piece.data() + sizeof received_ns, size);
    message.write(stream);
    RAVENCAL_RETURN_IF_ERROR(send(piece));
  }
  return {};
}

}  // namespace

core::Result<std::vector<BagTopic>> bag_topics(const fs::path& path) {
  std::vector<BagTopic> topics;
  const auto take = [&](std::span<const std::uint8_t> piece) -> core::Status {
    RosReader reader(piece);
    const BagTopic topic{reader.text(), reader.text(), reader.text()};
    const bool known = std::any_of(topics.begin(), topics.end(), [&](const BagTopic& other) {
      return other.name == topic.name && other.md5 == topic.md5;
    });
    if (!known) topics.push_back(topic);
    return {};
  };
  RAVENCAL_RETURN_IF_ERROR(read_bag(path, send_topics, take));
  return topics;
}

core::Status for_each_message(const fs::path& path, const std::string& topic,
                              const TakeMessage& take) {
  const auto send = [&](rosbag::Bag& bag, const core::TakePiece& piece) {
    return send_messages(bag, path, topic, piece);
  };
  return read_bag(path, send, [&](std::span<const std::uint8_t> piece) -> core::Status {
    std::int64_t received_ns = 0;
    if (piece.size() < sizeof received_ns) return bad_bag(path, "a message without a time");
    std::memcpy(&received_ns, piece.data(), sizeof received_ns);
    return take(received_ns, piece.subspan(sizeof received_ns));
  });
}

struct BagWriter::Impl {
  Impl(fs::path written, core::PartialFile partial)
      : path(std::move(written)), target(std::move(partial)) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  // The library's destructor closes the bag. On a full disk that throws, which would end the
  // process: such a bag is left alone.
  ~Impl() {
    try {
      bag->close();
    } catch (const std::exception&) {
      (void)bag.release();  // NOLINT(bugprone-unused-return-value)
    }
  }

  fs::path path;  ///< as the user wrote it, for messages
  core::PartialFile target;
  std::unique_ptr<rosbag::Bag> bag = std::make_unique<rosbag::Bag>();
};

BagWriter::BagWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;
BagWriter::~BagWriter() = default;

core::Result<BagWriter> BagWriter::create(const fs::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(core::PartialFile target, core::PartialFile::create(path));
  auto impl = std::make_unique<Impl>(path, std::move(target));
  const auto open = [&]() -> core::Status {
    impl->bag->open(impl->target.partial().string(), rosbag::bagmode::Write);
    return {};
  };
  RAVENCAL_RETURN_IF_ERROR(guarded(path, open, unwritten));
  return BagWriter(std::move(impl));
}

core::Status BagWriter::write(const std::string& topic, const RosMessageType& type,
                              std::int64_t received_ns, std::span<const std::uint8_t> bytes) {
  const auto write_one = [&]() -> core::Status {
    const RosRawMessage message{&type, {bytes.begin(), bytes.end()}};
    impl_->bag->write(topic, time_of(received_ns), message);
    return {};
  };
  return guarded(impl_->path, write_one, unwritten);
}

core::Status BagWriter::close() {
  const auto close_it = [&]() -> core::Status {
    impl_->bag->close();
    return impl_->target.publish();
  };
  return guarded(impl_->path, close_it, unwritten);
}

}  // namespace ravencal::record
