// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/can_link.hpp"

#include <fmt/format.h>
#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

namespace ravencal::quadrature_reader {
namespace {

using Bytes = std::span<const std::byte>;

/// Calls `take(type, payload)` for each attribute; stops where a length does not fit.
template <typename Take>
void for_each_attribute(Bytes bytes, const Take& take) {
  while (bytes.size() >= sizeof(rtattr)) {
    rtattr attribute{};
    std::memcpy(&attribute, bytes.data(), sizeof(attribute));
    if (attribute.rta_len < sizeof(attribute) || attribute.rta_len > bytes.size()) return;
    take(attribute.rta_type & NLA_TYPE_MASK,
         bytes.subspan(sizeof(attribute), attribute.rta_len - sizeof(attribute)));
    bytes = bytes.subspan(std::min<std::size_t>(RTA_ALIGN(attribute.rta_len), bytes.size()));
  }
}

std::uint32_t word_of(Bytes bytes) {
  std::uint32_t word = 0;
  if (bytes.size() >= sizeof(word)) std::memcpy(&word, bytes.data(), sizeof(word));
  return word;
}

void take_controller(Bytes bytes, CanLink& link) {
  for_each_attribute(bytes, [&](int type, Bytes value) {
    if (type == IFLA_CAN_STATE) link.state = static_cast<CanState>(word_of(value));
    if (type == IFLA_CAN_RESTART_MS) link.restart_ms = word_of(value);
    // struct can_bittiming begins with the bit rate.
    if (type == IFLA_CAN_BITTIMING) link.bitrate_hz = word_of(value);
  });
}

void take_link_info(Bytes bytes, CanLink& link) {
  for_each_attribute(bytes, [&](int type, Bytes value) {
    if (type == IFLA_INFO_KIND) {
      link.kind.assign(reinterpret_cast<const char*>(value.data()), value.size());
      link.kind.resize(std::strlen(link.kind.c_str()));
    }
    if (type == IFLA_INFO_DATA) take_controller(value, link);
  });
}

core::Error link_error(const std::string& interface) {
  return {core::ErrorCode::kDevice,
          fmt::format("CAN interface {}: {}", interface, std::strerror(errno))};
}

/// Asks the kernel on an open netlink socket; the answer, or nothing.
std::vector<std::byte> ask(int socket_fd, unsigned index) {
  struct {
    nlmsghdr header;
    ifinfomsg link;
  } request{};
  request.header.nlmsg_len = sizeof(request);
  request.header.nlmsg_type = RTM_GETLINK;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.link.ifi_family = AF_UNSPEC;
  request.link.ifi_index = static_cast<int>(index);
  std::vector<std::byte> answer(32768);  // as iproute2 reserves
  ssize_t size = -1;
  if (::send(socket_fd, &request, sizeof(request), 0) == static_cast<ssize_t>(sizeof(request))) {
    size = ::recv(socket_fd, answer.data(), answer.size(), 0);
  }
  answer.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return answer;
}

}  // namespace

core::Result<CanLink> parse_can_link(Bytes message) {
  constexpr std::size_t kFront = NLMSG_LENGTH(sizeof(ifinfomsg));
  nlmsghdr header{};
  ifinfomsg info{};
  if (message.size() >= kFront) {
    std::memcpy(&header, message.data(), sizeof(header));
    std::memcpy(&info, message.data() + NLMSG_HDRLEN, sizeof(info));
  }
  if (header.nlmsg_type != RTM_NEWLINK || header.nlmsg_len < kFront ||
      header.nlmsg_len > message.size()) {
    return core::Error{core::ErrorCode::kData, "the kernel's answer describes no interface"};
  }
  CanLink link;
  link.is_can = info.ifi_type == ARPHRD_CAN;
  link.up = (info.ifi_flags & IFF_UP) != 0;
  for_each_attribute(message.subspan(kFront, header.nlmsg_len - kFront),
                     [&](int type, Bytes value) {
                       if (type == IFLA_LINKINFO) take_link_info(value, link);
                     });
  return link;
}

core::Result<CanLink> read_can_link(const std::string& interface) {
  const unsigned index = ::if_nametoindex(interface.c_str());
  if (index == 0) return link_error(interface);
  const int socket_fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (socket_fd < 0) return link_error(interface);
  const std::vector<std::byte> answer = ask(socket_fd, index);
  ::close(socket_fd);
  if (answer.empty()) return link_error(interface);
  return parse_can_link(answer);
}

}  // namespace ravencal::quadrature_reader
