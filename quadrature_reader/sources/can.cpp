// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/can.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/constants.hpp"
#include "quadrature_reader/clock_offset.hpp"
#include "quadrature_reader/sources/can_clock.hpp"
#include "quadrature_reader/sources/can_decoder.hpp"

namespace ravencal::quadrature_reader {
namespace {

// A frame is stamped on its way to the socket: wait this long before calling the queue complete.
constexpr std::int64_t kFrameDeliveryNs = 1'000'000;
constexpr int kReceiveBufferBytes = 4 << 20;
constexpr int kLargestBatch = 512;
constexpr std::size_t kSocketMemoryWords = 16;  // SK_MEMINFO_VARS (9) and room for more
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
                                                std::vector<Reading>& out);
  /// The frame's time from what came with it, on CLOCK_MONOTONIC.
  std::int64_t stamp_of(const scm_timestamping* stamps, std::int64_t realtime_offset_ns,
                        std::vector<Reading>& out);
  void count_drops(std::uint32_t dropped, std::int64_t t_ns, std::vector<Reading>& out);
  void look_for_silent_drops(std::int64_t now_ns, std::vector<Reading>& out);
  void send(std::uint32_t id, std::span<const std::uint8_t> data) const;
  void keep_nodes_going(std::int64_t now_ns);
  void close_socket();
  [[nodiscard]] core::Error device_error(std::string_view what) const {
    return {core::ErrorCode::kDevice,
            fmt::format("CAN interface {}: {}: {}", settings_.device, what, std::strerror(errno))};
  }

  SourceSettings settings_;
  CanDecoder decoder_;
  CanClock clock_;
  Fault stamps_ = Fault::kNone;  // whose time stamps the frames bear
  int socket_ = -1;
  std::uint32_t dropped_ = 0;  // the kernel's count of frames that found our queue full
  std::int64_t last_t_ns_ = 0;
  std::int64_t next_sync_ns_ = 0;
};

core::Status CanSource::open() {
  close_socket();
  dropped_ = 0;
  clock_ = CanClock();
  stamps_ = Fault::kNone;
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
  const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE |
                     SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
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
  std::int64_t wait_ns = std::chrono::nanoseconds(timeout).count();
  if (settings_.sync_period_ns > 0) {
    wait_ns = std::clamp<std::int64_t>(next_sync_ns_ - monotonic_now_ns(), 0, wait_ns);
  }
  const timespec wait_time{wait_ns / core::kNsPerS, wait_ns % core::kNsPerS};
  if (::ppoll(&wait, 1, &wait_time, nullptr) < 0 && errno != EINTR)
    return device_error("waiting failed");
  const std::int64_t now_ns = monotonic_now_ns();
  const std::int64_t offset_ns = measure_realtime_offset().offset_ns;
  bool emptied = false;
  for (int i = 0; i < kLargestBatch && !emptied; ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(const auto frame, receive(offset_ns, out));
    emptied = !frame;
    if (frame) decoder_.take(*frame, out);
  }
  if (emptied) look_for_silent_drops(std::max(now_ns, last_t_ns_), out);
  // While frames wait in the queue, silence cannot be judged.
  decoder_.watch(emptied ? std::max(now_ns, last_t_ns_) : last_t_ns_, out);
  keep_nodes_going(now_ns);
  const std::int64_t complete_ns =
      emptied ? now_ns - kFrameDeliveryNs : last_t_ns_ - kFrameDeliveryNs;
  out.push_back({std::max(complete_ns, last_t_ns_), 0, kEveryAxis, ReadingKind::kAlive, Line::kA,
                 Fault::kNone});
  return {};
}

core::Result<std::optional<CanFrame>> CanSource::receive(std::int64_t realtime_offset_ns,
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
  scm_timestamping stamps{};
  bool stamped = false;
  std::optional<std::uint32_t> dropped;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET) continue;
    if (header->cmsg_type == SO_TIMESTAMPING) {
      std::memcpy(&stamps, CMSG_DATA(header), sizeof(stamps));
      stamped = true;
    } else if (header->cmsg_type == SO_RXQ_OVFL) {
      dropped.emplace();
      std::memcpy(&*dropped, CMSG_DATA(header), sizeof(*dropped));
    }
  }
  CanFrame frame;
  // A step of the wall clock between stamping and now must move no frame to the future
  // or behind its predecessor.
  last_t_ns_ = frame.t_ns =
      std::clamp(stamp_of(stamped ? &stamps : nullptr, realtime_offset_ns, out), last_t_ns_,
                 std::max(monotonic_now_ns(), last_t_ns_));
  if (dropped) count_drops(*dropped, frame.t_ns, out);
  frame.id = raw.can_id;
  frame.length = std::min<std::uint8_t>(raw.len, sizeof(raw.data));
  std::copy_n(raw.data, frame.length, frame.data.begin());
  return std::optional<CanFrame>(frame);
}

std::int64_t CanSource::stamp_of(const scm_timestamping* stamps, std::int64_t realtime_offset_ns,
                                 std::vector<Reading>& out) {
  const auto ns_of = [](const timespec& t) {
    return std::int64_t{t.tv_sec} * core::kNsPerS + t.tv_nsec;
  };
  // ts[0] is the kernel's stamp on the wall clock, ts[2] the adapter's on its own.
  const std::int64_t kernel_ns = stamps != nullptr ? ns_of(stamps->ts[0]) : 0;
  const std::int64_t adapter_ns = stamps != nullptr ? ns_of(stamps->ts[2]) : 0;
  const std::int64_t arrived_ns =
      kernel_ns != 0 ? kernel_ns - realtime_offset_ns : monotonic_now_ns();
  const Fault whose = adapter_ns != 0  ? Fault::kStampsHardware
                      : kernel_ns != 0 ? Fault::kStampsKernel
                                       : Fault::kStampsArrival;
  const std::int64_t t_ns =
      adapter_ns != 0 ? clock_.to_monotonic(adapter_ns, arrived_ns) : arrived_ns;
  if (whose != stamps_) {
    out.push_back(
        {std::max(t_ns, last_t_ns_), 0, kEveryAxis, ReadingKind::kNotice, Line::kA, whose});
    stamps_ = whose;
  }
  return t_ns;
}

void CanSource::count_drops(std::uint32_t dropped, std::int64_t t_ns, std::vector<Reading>& out) {
  const auto missing = static_cast<std::int32_t>(dropped - dropped_);
  if (missing <= 0) return;  // told already
  out.push_back({t_ns, missing, kEveryAxis, ReadingKind::kLost, Line::kA, Fault::kQueueOverflow});
  dropped_ = dropped;
}

void CanSource::look_for_silent_drops(std::int64_t now_ns, std::vector<Reading>& out) {
  // A frame brings the count of those dropped before it; after the last frame nothing does.
  std::uint32_t memory[kSocketMemoryWords] = {};
  socklen_t size = sizeof(memory);
  if (::getsockopt(socket_, SOL_SOCKET, SO_MEMINFO, memory, &size) == 0 &&
      size > SK_MEMINFO_DROPS * sizeof(memory[0])) {
    count_drops(memory[SK_MEMINFO_DROPS], now_ns, out);
  }
}

void CanSource::send(std::uint32_t id, std::span<const std::uint8_t> data) const {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data);
  // A full transmit queue or an absent bus makes the node silent, which is supervised.
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
