// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "quadrature_reader/setup_device.hpp"

namespace ravencal::quadrature_reader {
namespace {

using Message = std::vector<std::byte>;

void append(Message& message, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::byte*>(data);
  message.insert(message.end(), bytes, bytes + size);
  message.resize((message.size() + 3) / 4 * 4);
}

Message attribute(unsigned short type, const Message& payload) {
  const rtattr header{static_cast<unsigned short>(sizeof(rtattr) + payload.size()), type};
  Message message;
  append(message, &header, sizeof(header));
  append(message, payload.data(), payload.size());
  return message;
}

Message attribute(unsigned short type, std::uint32_t word) {
  Message payload;
  append(payload, &word, sizeof(word));
  return attribute(type, payload);
}

Message joined(std::initializer_list<Message> parts) {
  Message all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// RTM_NEWLINK of an interface that is up, with a controller as given.
Message link_message(std::uint32_t state, std::uint32_t bitrate, std::uint32_t restart_ms) {
  Message kind;
  append(kind, "can", 4);
  can_bittiming timing{};
  timing.bitrate = bitrate;
  Message timing_bytes;
  append(timing_bytes, &timing, sizeof(timing));
  const Message info = attribute(
      IFLA_LINKINFO,
      joined({attribute(IFLA_INFO_KIND, kind),
              attribute(IFLA_INFO_DATA, joined({attribute(IFLA_CAN_BITTIMING, timing_bytes),
                                                attribute(IFLA_CAN_STATE, state),
                                                attribute(IFLA_CAN_RESTART_MS, restart_ms)}))}));
  nlmsghdr header{};
  ifinfomsg link{};
  link.ifi_type = ARPHRD_CAN;
  link.ifi_flags = IFF_UP;
  header.nlmsg_type = RTM_NEWLINK;
  header.nlmsg_len = static_cast<std::uint32_t>(NLMSG_LENGTH(sizeof(link)) + info.size());
  Message message;
  append(message, &header, sizeof(header));
  append(message, &link, sizeof(link));
  return joined({message, info});
}

std::string text_of(const std::vector<SetupFinding>& findings) {
  std::string text;
  for (const auto& finding : findings) text += finding.text + '\n';
  return text;
}

TEST(CanLink, ReadsStateBitRateAndRestartFromTheKernelsAnswer) {
  const auto link = parse_can_link(link_message(CAN_STATE_ERROR_PASSIVE, 500'000, 100));
  ASSERT_TRUE(link.ok()) << link.error().message;
  EXPECT_TRUE(link->is_can);
  EXPECT_TRUE(link->up);
  EXPECT_EQ(link->kind, "can");
  EXPECT_EQ(link->state, CanState::kErrorPassive);
  EXPECT_EQ(link->bitrate_hz, 500'000U);
  EXPECT_EQ(link->restart_ms, 100U);
}

TEST(CanLink, SurvivesEveryTruncationAndEveryWrongLength) {
  const Message whole = link_message(0, 500'000, 100);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_can_link(std::span(whole).first(size)).ok()) << size;
  }
  for (std::size_t at = sizeof(nlmsghdr) + sizeof(ifinfomsg); at < whole.size(); ++at) {
    for (const auto value : {std::byte{0}, std::byte{3}, std::byte{255}}) {
      Message broken = whole;
      broken[at] = value;
      (void)parse_can_link(broken);  // reads nothing outside; the sanitizers watch
    }
  }
}

TEST(SetupCheck, JudgesTheBusAndGivesTheRemedy) {
  CanLink link{true, true, "can", CanState::kErrorActive, 1'000'000, 100};
  EXPECT_FALSE(any_bad(can_findings("can-raven", link)));
  EXPECT_NE(text_of(can_findings("can-raven", link)).find("ERROR-ACTIVE"), std::string::npos);
  link.restart_ms = 0;
  EXPECT_NE(text_of(can_findings("can-raven", link)).find("RestartSec"), std::string::npos);
  link.state = CanState::kErrorPassive;
  EXPECT_NE(text_of(can_findings("can-raven", link)).find("terminations"), std::string::npos);
  link.state = CanState::kBusOff;
  EXPECT_TRUE(any_bad(can_findings("can-raven", link)));
  link = {true, false, "can", CanState::kStopped, 0, 0};
  EXPECT_NE(text_of(can_findings("can-raven", link)).find("is down"), std::string::npos);
  EXPECT_TRUE(any_bad(can_findings("can-raven", link)));
  EXPECT_TRUE(any_bad(can_findings("eth0", {})));
  EXPECT_FALSE(any_bad(can_findings("vcan0", {true, true, "vcan", {}, 0, 0})));
}

TEST(SetupCheck, NamesADeviceThatIsMissing) {
  const auto finding = device_file_finding("/dev/ravencal/no-such-chip");
  EXPECT_EQ(finding.verdict, Verdict::kBad);
  EXPECT_NE(finding.text.find("udev rules"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
