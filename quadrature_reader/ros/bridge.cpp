// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/ros/bridge.hpp"

#include <fmt/format.h>
#include <ros/ros.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <thread>

#include "core/spsc_ring.hpp"
#include "quadrature_reader/clock_offset.hpp"
#include "quadrature_reader/ros/state_recorder.hpp"
#include "record/ros_raw_message.hpp"

namespace ravencal::quadrature_reader {

/// A ravenstate as it comes off the wire.
struct RavenStateBytes {
  std::vector<std::uint8_t> bytes;
};

}  // namespace ravencal::quadrature_reader

namespace ros {

namespace message_traits {
template <>
struct IsMessage<ravencal::quadrature_reader::RavenStateBytes> : TrueType {};
template <>
struct MD5Sum<ravencal::quadrature_reader::RavenStateBytes> {
  static const char* value() { return ravencal::record::raven_state_type().md5.data(); }
  static const char* value(const ravencal::quadrature_reader::RavenStateBytes& /*message*/) {
    return value();
  }
};
template <>
struct DataType<ravencal::quadrature_reader::RavenStateBytes> {
  static const char* value() { return ravencal::record::raven_state_type().name.data(); }
  static const char* value(const ravencal::quadrature_reader::RavenStateBytes& /*message*/) {
    return value();
  }
};
template <>
struct Definition<ravencal::quadrature_reader::RavenStateBytes> {
  static const char* value() { return ravencal::record::raven_state_type().definition.data(); }
  static const char* value(const ravencal::quadrature_reader::RavenStateBytes& /*message*/) {
    return value();
  }
};
}  // namespace message_traits

namespace serialization {
template <>
struct Serializer<ravencal::quadrature_reader::RavenStateBytes> {
  template <typename Stream>
  static void read(Stream& stream, ravencal::quadrature_reader::RavenStateBytes& message) {
    const std::uint32_t length = stream.getLength();
    const std::uint8_t* from = stream.advance(length);
    message.bytes.assign(from, from + length);
  }
};
}  // namespace serialization
}  // namespace ros

namespace ravencal::quadrature_reader {
namespace {

constexpr std::size_t kMostJoints = 16;
constexpr std::size_t kRingRows = 1024;        // 10 s at 100 Hz
constexpr std::uint32_t kStateQueue = 10'000;  // messages: 10 s of the controller
constexpr std::uint32_t kPublishQueue = 100;
constexpr auto kPollPeriod = std::chrono::milliseconds(2);
constexpr auto kMasterPeriod = std::chrono::milliseconds(500);
constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::int64_t kReplayedNs = 60 * kSecondNs;  // older rows are a replay's
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

struct Row {
  std::int64_t t_ns = 0;
  std::array<double, kMostJoints> counts{};
  std::array<double, kMostJoints> position_si{};
};

ros::AdvertiseOptions joint_state_topic(const std::string& name) {
  const record::RosMessageType& type = record::joint_state_type();
  return {name, kPublishQueue, std::string(type.md5), std::string(type.name),
          std::string(type.definition)};
}

}  // namespace

struct RosBridge::Impl {
  explicit Impl(RosBridgeOptions given)
      : options(std::move(given)),
        period_ns(std::llround(1e9 / options.rate_hz)),
        states(options.robot_recording, options.arm) {}

  void run();
  bool wait_for_master();
  void publish(const Row& row, ros::Publisher& counts, ros::Publisher& positions);
  std::int64_t wall_of(std::int64_t t_ns);
  void take_state(const RavenStateBytes& message);
  void complain(const std::string& why) {
    const std::lock_guard lock(trouble_mutex);
    trouble = why;
  }

  RosBridgeOptions options;
  std::int64_t period_ns;
  core::SpscRing<Row> ring{kRingRows};        // writer thread to publisher thread
  std::int64_t next_ns = INT64_MIN;           // writer thread
  StateRecorder states;                       // spinner thread; finish(): after it has ended
  std::int64_t next_maintain_ns = 0;          // spinner thread
  std::int64_t wall_minus_row_ns = 0;         // publisher thread
  std::int64_t wall_measured_ns = INT64_MIN;  // publisher thread: row time of the measurement
  std::atomic<bool> stop{false};
  std::atomic<bool> connected{false};
  std::atomic<std::int64_t> published{0};
  std::atomic<std::int64_t> not_published{0};
  std::atomic<std::int64_t> state_rows{0};
  std::atomic<std::int64_t> states_refused{0};
  mutable std::mutex trouble_mutex;
  std::string trouble;  // guarded by trouble_mutex
  std::thread thread;
};

bool RosBridge::Impl::wait_for_master() {
  while (!stop.load()) {
    if (ros::master::check()) return true;
    complain(fmt::format("no ROS master at {}; waiting for one", ros::master::getURI()));
    for (auto slept = std::chrono::milliseconds(0); slept < kMasterPeriod && !stop.load();
         slept += kPollPeriod) {
      std::this_thread::sleep_for(kPollPeriod);
    }
  }
  return false;
}

void RosBridge::Impl::run() {
  if (!wait_for_master()) return;
  complain("");
  connected = true;
  // A master that goes away must not hold up the end of the program.
  ros::master::setRetryTimeout(ros::WallDuration(1.0));
  {
    ros::NodeHandle node;
    ros::AdvertiseOptions counts_topic = joint_state_topic("joint_enc");
    ros::AdvertiseOptions positions_topic = joint_state_topic("ext_jpos");
    ros::Publisher counts = node.advertise(counts_topic);
    ros::Publisher positions = node.advertise(positions_topic);
    const boost::function<void(const boost::shared_ptr<RavenStateBytes const>&)> on_state =
        [this](const boost::shared_ptr<RavenStateBytes const>& message) { take_state(*message); };
    const ros::Subscriber robot =
        node.subscribe<RavenStateBytes>("ravenstate", kStateQueue, on_state, ros::VoidConstPtr(),
                                        ros::TransportHints().tcpNoDelay());
    ros::AsyncSpinner spinner(1);
    spinner.start();
    Row row;
    while (!stop.load()) {
      while (ring.try_pop(row)) publish(row, counts, positions);
      std::this_thread::sleep_for(kPollPeriod);
    }
    spinner.stop();
  }
  ros::shutdown();
}

std::int64_t RosBridge::Impl::wall_of(std::int64_t t_ns) {
  if (wall_measured_ns == INT64_MIN || t_ns - wall_measured_ns >= kSecondNs) {
    const ClockOffset offset = measure_realtime_offset();
    const bool replay = std::abs(offset.monotonic_ns - t_ns) > kReplayedNs;
    // A replay's rows are published as if they were happening now.
    if (!replay) {
      wall_minus_row_ns = offset.offset_ns;
    } else if (wall_measured_ns == INT64_MIN) {
      wall_minus_row_ns = offset.offset_ns + offset.monotonic_ns - t_ns;
    }
    wall_measured_ns = t_ns;
  }
  return t_ns + wall_minus_row_ns;
}

void RosBridge::Impl::publish(const Row& row, ros::Publisher& counts, ros::Publisher& positions) {
  const auto n = static_cast<std::ptrdiff_t>(options.joints.size());
  record::JointStateMessage message;
  message.stamp_ns = wall_of(row.t_ns);
  message.names = options.joints;
  const auto send = [&](const std::array<double, kMostJoints>& values, ros::Publisher& publisher) {
    message.positions.assign(values.begin(), values.begin() + n);
    bool any = false;
    for (const double value : message.positions) any = any || !std::isnan(value);
    if (any) {
      publisher.publish(
          record::RosRawMessage{&record::joint_state_type(), record::encode_joint_state(message)});
    }
  };
  send(row.counts, counts);
  send(row.position_si, positions);
  ++published;
}

void RosBridge::Impl::take_state(const RavenStateBytes& message) {
  if (const core::Status status = states.take(message.bytes); !status.ok()) {
    ++states_refused;
    complain(status.error().message);
  }
  state_rows = states.rows();
  const std::int64_t now_ns = measure_realtime_offset().monotonic_ns;
  if (now_ns < next_maintain_ns) return;
  states.maintain(now_ns);
  next_maintain_ns = now_ns + kSecondNs;
}

core::Result<std::unique_ptr<RosBridge>> RosBridge::create(const RosBridgeOptions& options) {
  if (options.joints.size() > kMostJoints) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("--publish-ros: at most {} joints", kMostJoints)};
  }
  // Without the variable ros::init aborts; this is what ROS's own set-up files say.
  (void)::setenv("ROS_MASTER_URI", "http://localhost:11311", 0);
  ros::init(ros::M_string(), "ravencal_encoders",
            ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
  std::unique_ptr<RosBridge> bridge(new RosBridge(std::make_unique<Impl>(options)));
  bridge->impl_->thread = std::thread([impl = bridge->impl_.get()] { impl->run(); });
  return bridge;
}

RosBridge::RosBridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

RosBridge::~RosBridge() { (void)finish(); }

void RosBridge::offer(std::int64_t t_ns, std::span<const AxisSample> samples) {
  if (t_ns < impl_->next_ns) return;
  impl_->next_ns = t_ns + impl_->period_ns - t_ns % impl_->period_ns;
  Row row;
  row.t_ns = t_ns;
  for (std::size_t i = 0; i < samples.size() && i < kMostJoints; ++i) {
    row.counts[i] = samples[i].counts_valid ? samples[i].counts : kUnknown;
    row.position_si[i] = samples[i].position_valid ? samples[i].position_si : kUnknown;
  }
  if (impl_->connected.load(std::memory_order_relaxed) && !impl_->ring.try_push(row))
    ++impl_->not_published;
}

core::Status RosBridge::finish() {
  impl_->stop = true;
  if (!impl_->thread.joinable()) return {};
  impl_->thread.join();
  if (impl_->states.lost_rows()) {
    ++impl_->states_refused;
    impl_->complain("rows of the robot's recording were lost to the disk");
  }
  return impl_->states.finish();
}

RosBridgeStatus RosBridge::status() const {
  const std::lock_guard lock(impl_->trouble_mutex);
  return {impl_->connected.load(),  impl_->published.load(),      impl_->not_published.load(),
          impl_->state_rows.load(), impl_->states_refused.load(), impl_->trouble};
}

}  // namespace ravencal::quadrature_reader
