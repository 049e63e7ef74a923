// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/can.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "quadrature_reader/clock_offset.hpp"
#include "quadrature_reader/sources/can_decoder.hpp"

namespace ravencal::quadrature_reader {
namespace {

// A frame is stamped on its way to the socket: wait this long before calling the queue complete.
constexpr std::int64_t kDeliveryNs = 1'000'000;
constexpr int kReceiveBufferBytes = 4 << 20;
constexpr int kLargestBatch = 512;
// CiA 301: NMT command, SYNC.
constexpr std::uint32_t kNmt = 0x000;
constexpr std::uint32_t kSync = 0x080;
constexpr std::uint8_t kNmtStart = 0x01;

class CanSource final : public Source {
 public:
  explicit CanSource(const SourceSettings& settings) : settings_(settings), decoder_(settings) {}
  CanSource(const CanSource&) = delete;
  CanSource& operator=(const CanSource&) = delete;
  ~CanSource() override { close_socket(); }

  core::Status open() override;
  core::Status read(std::vector<Reading>& out, std::chrono::milliseconds timeout) override;

 private:
  core::Status check_interface_is_up();
  core::Status configure();
  core::Status bind_to_interface();
  /// One frame from the socket; nullopt if none waits.
  core::Result<std::optional<CanFrame>> receive(std::int64_t realtime_offset_ns,
                                                std::int64_t now_ns, std::vector<Reading>& out);
  void send(std::uint32_t id, std::span<const std::uint8_t> data) const;
  void keep_nodes_going(std::int64_t now_ns);
  void close_socket();
  [[nodiscard]] core::Error device_error(std::string_view what) const {
    return {core::ErrorCode::kDevice,
            fmt::format("CAN interface {}: {}: {}", settings_.device, what, std::strerror(errno))};
  }

  SourceSettings settings_;
  CanDecoder decoder_;
  int socket_ = -1;
  std::uint32_t dropped_ = 0;  // the kernel's count of frames that found our queue full
  std::int64_t last_t_ns_ = 0;
  std::int64_t next_sync_ns_ = 0;
};

core::Status CanSource::open() {
  close_socket();
  dropped_ = 0;
  next_sync_ns_ = monotonic_now_ns();
  socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  if (socket_ < 0) return device_error("no CAN socket");
  RAVENCAL_RETURN_IF_ERROR(check_interface_is_up());
  RAVENCAL_RETURN_IF_ERROR(configure());
  RAVENCAL_RETURN_IF_ERROR(bind_to_interface());
  if (!settings_.start_nodes) return {};
  for (const auto& encoder : settings_.can) {
    if (encoder.canopen_node) {
      const std::uint8_t command[2] = {kNmtStart, static_cast<std::uint8_t>(*encoder.canopen_node)};
      send(kNmt, command);
    }
  }
  return {};
}

core::Status CanSource::check_interface_is_up() {
  ifreq request{};
  std::strncpy(request.ifr_name, settings_.device.c_str(), sizeof(request.ifr_name) - 1);
  if (::ioctl(socket_, SIOCGIFFLAGS, &request) != 0) return device_error("cannot be found");
  if ((request.ifr_flags & IFF_UP) != 0) return {};
  errno = ENETDOWN;
  return device_error(fmt::format("is down; bring it up with 'ip link set {} up' (udev/README.md)",
                                  settings_.device));
}

core::Status CanSource::configure() {
  std::vector<can_filter> filters;
  for (const auto& encoder : settings_.can) {
    const std::uint32_t flag = encoder.extended ? CAN_EFF_FLAG : 0U;
    filters.push_back({encoder.id | flag, CAN_EFF_FLAG | CAN_RTR_FLAG |
                                              (encoder.extended ? CAN_EFF_MASK : CAN_SFF_MASK)});
    if (encoder.canopen_node) {
      filters.push_back(
          {0x700U + *encoder.canopen_node, CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_SFF_MASK});
    }
  }
  const auto set = [this](int level, int name, const void* value, std::size_t size) {
    return ::setsockopt(socket_, level, name, value, static_cast<socklen_t>(size)) == 0;
  };
  const can_err_mask_t errors = CAN_ERR_MASK;
  const int on = 1;
  const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  if (!set(SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), filters.size() * sizeof(can_filter)) ||
      !set(SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof(errors)) ||
      !set(SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof(on)) ||
      !set(SOL_SOCKET, SO_TIMESTAMPING, &stamps, sizeof(stamps)) ||
      !set(SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof(on))) {
    return device_error("cannot configure the socket");
  }
  // Beyond the system's limit only with CAP_NET_ADMIN; what is granted is good enough.
  if (!set(SOL_SOCKET, SO_RCVBUFFORCE, &kReceiveBufferBytes, sizeof(kReceiveBufferBytes))) {
    (void)set(SOL_SOCKET, SO_RCVBUF, &kReceiveBufferBytes, sizeof(kReceiveBufferBytes));
  }
  return {};
}

core::Status CanSource::bind_to_interface() {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(settings_.device.c_str()));
  if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return device_error("cannot bind");
  }
  return {};
}

core::Status CanSource::read(std::vector<Reading>& out, std::chrono::milliseconds timeout) {
  pollfd wait{socket_, POLLIN, 0};
  auto wait_ms = timeout.count();
  if (settings_.sync_period_ns > 0) {
    wait_ms =
        std::clamp<std::int64_t>((next_sync_ns_ - monotonic_now_ns()) / 1'000'000, 0, wait_ms);
  }
  if (::poll(&wait, 1, static_cast<int>(wait_ms)) < 0 && errno != EINTR)
    return device_error("waiting failed");
  const std::int64_t now_ns = monotonic_now_ns();
  const std::int64_t offset_ns = measure_realtime_offset().offset_ns;
  for (int i = 0; i < kLargestBatch; ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(const auto frame, receive(offset_ns, now_ns, out));
    if (!frame) break;
    decoder_.take(*frame, out);
  }
  decoder_.watch(std::max(now_ns, last_t_ns_), out);
  keep_nodes_going(now_ns);
  out.push_back({std::max(now_ns - kDeliveryNs, last_t_ns_), 0, kEveryAxis, ReadingKind::kAlive,
                 Line::kA, Fault::kNone});
  return {};
}

core::Result<std::optional<CanFrame>> CanSource::receive(std::int64_t realtime_offset_ns,
                                                         std::int64_t now_ns,
                                                         std::vector<Reading>& out) {
  canfd_frame raw{};
  alignas(cmsghdr) char control[256];
  iovec vector{&raw, sizeof(raw)};
  msghdr message{};
  message.msg_iov = &vector;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof(control);
  const ssize_t size = ::recvmsg(socket_, &message, 0);
  if (size < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return std::optional<CanFrame>();
    return device_error("receiving failed");
  }
  CanFrame frame;
  frame.t_ns = now_ns;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET) continue;
    if (header->cmsg_type == SO_TIMESTAMPING) {
      scm_timestamping stamp{};
      std::memcpy(&stamp, CMSG_DATA(header), sizeof(stamp));
      const std::int64_t realtime =
          std::int64_t{stamp.ts[0].tv_sec} * 1'000'000'000 + stamp.ts[0].tv_nsec;
      if (realtime != 0) frame.t_ns = realtime - realtime_offset_ns;
    } else if (header->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(header), sizeof(dropped));
      if (dropped != dropped_) {
        out.push_back({std::max(frame.t_ns, last_t_ns_), dropped - dropped_, kEveryAxis,
                       ReadingKind::kLost, Line::kA, Fault::kQueueOverflow});
        dropped_ = dropped;
      }
    }
  }
  // A step of the wall clock between stamping and now must move no frame to the future
  // or behind its predecessor.
  last_t_ns_ = frame.t_ns = std::max(std::min(frame.t_ns, monotonic_now_ns()), last_t_ns_);
  frame.id = raw.can_id;
  frame.length = std::min<std::uint8_t>(raw.len, sizeof(raw.data));
  std::copy_n(raw.data, frame.length, frame.data.begin());
  return std::optional<CanFrame>(frame);
}

void CanSource::send(std::uint32_t id, std::span<const std::uint8_t> data) const {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data);
  // A full transmit queue or an absent bus shows itself as silence of the node, which is watched.
  (void)!::write(socket_, &frame, sizeof(frame));
}

void CanSource::keep_nodes_going(std::int64_t now_ns) {
  for (const unsigned node : decoder_.take_nodes_to_start()) {
    const std::uint8_t command[2] = {kNmtStart, static_cast<std::uint8_t>(node)};
    send(kNmt, command);
  }
  if (settings_.sync_period_ns > 0 && now_ns >= next_sync_ns_) {
    send(kSync, {});
    next_sync_ns_ = std::max(next_sync_ns_ + settings_.sync_period_ns, now_ns);
  }
}

void CanSource::close_socket() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

}  // namespace

std::unique_ptr<Source> make_can_source(const SourceSettings& settings) {
  return std::make_unique<CanSource>(settings);
}

}  // namespace ravencal::quadrature_reader
