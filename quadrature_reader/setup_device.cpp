// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/setup_device.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

namespace ravencal::quadrature_reader {
namespace {

constexpr rlim_t kLockedBytes = 64U << 20U;  // as the systemd unit grants

std::string name_of_group(gid_t id) {
  const group* found = getgrgid(id);
  return found != nullptr ? found->gr_name : fmt::format("{}", id);
}

/// True if the user is listed in the group, whatever groups this session got at log-in.
bool is_listed(gid_t id) {
  const passwd* user = getpwuid(getuid());
  const group* members = getgrgid(id);
  if (user == nullptr || members == nullptr) return false;
  for (char** member = members->gr_mem; *member != nullptr; ++member) {
    if (std::string_view(*member) == user->pw_name) return true;
  }
  return false;
}

std::string_view name_of(CanState state) {
  switch (state) {
    case CanState::kErrorActive:
      return "ERROR-ACTIVE";
    case CanState::kErrorWarning:
      return "ERROR-WARNING";
    case CanState::kErrorPassive:
      return "ERROR-PASSIVE";
    case CanState::kBusOff:
      return "BUS-OFF";
    case CanState::kStopped:
      return "STOPPED";
    case CanState::kSleeping:
      return "SLEEPING";
  }
  return "unknown";
}

SetupFinding state_finding(const std::string& interface, CanState state) {
  const std::string found = fmt::format("{}: the bus is {}", interface, name_of(state));
  if (state == CanState::kErrorActive) return {Verdict::kGood, found};
  if (state == CanState::kErrorWarning || state == CanState::kErrorPassive) {
    return {Verdict::kWarning,
            found +
                ": frames are being destroyed; check bit rate, both 120 ohm terminations and "
                "ground"};
  }
  return {Verdict::kBad, fmt::format("{}; check the wiring, then 'ip link set {} type can restart'",
                                     found, interface)};
}

}  // namespace

std::vector<SetupFinding> realtime_findings() {
  rlimit priority{};
  rlimit locked{};
  getrlimit(RLIMIT_RTPRIO, &priority);
  getrlimit(RLIMIT_MEMLOCK, &locked);
  if (geteuid() == 0) {
    return {{Verdict::kGood, "real-time scheduling and locked memory are permitted"}};
  }
  std::vector<SetupFinding> findings;
  if (priority.rlim_cur > 0) {
    findings.push_back(
        {Verdict::kGood, fmt::format("real-time scheduling is permitted up to priority {} "
                                     "(--realtime-priority)",
                                     priority.rlim_cur)});
  } else {
    findings.push_back(
        {Verdict::kWarning,
         "real-time scheduling is not permitted: a busy machine may overflow the kernel's event "
         "queue; add '@ravencal - rtprio 50' to /etc/security/limits.d/ravencal.conf or use the "
         "systemd unit"});
  }
  if (locked.rlim_cur >= kLockedBytes) {
    findings.push_back({Verdict::kGood, "locked memory is permitted"});
  } else {
    findings.push_back(
        {Verdict::kWarning,
         fmt::format("only {} kB of memory may be locked: a page fault may cost edges; add "
                     "'@ravencal - memlock 65536' to /etc/security/limits.d/ravencal.conf or use "
                     "the systemd unit",
                     locked.rlim_cur / 1024)});
  }
  return findings;
}

SetupFinding device_file_finding(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return {Verdict::kBad,
            fmt::format("{}: {}; is the device plugged in, are the udev rules installed "
                        "(udev/README.md)?",
                        path.string(), std::strerror(errno))};
  }
  const std::string group_name = name_of_group(status.st_gid);
  const std::string found =
      fmt::format("{}: group {}, mode {:o}", path.string(), group_name, status.st_mode & 0777U);
  if (::access(path.c_str(), R_OK | W_OK) == 0) return {Verdict::kGood, found};
  if (is_listed(status.st_gid)) {
    return {Verdict::kBad,
            fmt::format("{}: you are in the group but this session is not; log in again", found)};
  }
  return {Verdict::kBad,
          fmt::format("{}: you may not use it; run 'sudo usermod -aG {} $USER' and log in again",
                      found, group_name)};
}

std::vector<SetupFinding> can_findings(const std::string& interface, const CanLink& link) {
  if (!link.is_can) {
    return {{Verdict::kBad, fmt::format("{} is no CAN interface; set 'interface' to the one that "
                                        "'ip -details link show type can' lists",
                                        interface)}};
  }
  std::vector<SetupFinding> findings;
  if (!link.up) {
    findings.push_back(
        {Verdict::kBad, fmt::format("{} is down; install udev/70-can-raven.network or run 'ip "
                                    "link set {} up type can bitrate 1000000 restart-ms 100'",
                                    interface, interface)});
  }
  if (!link.state) {
    findings.push_back({Verdict::kGood, fmt::format("{} is virtual ({}): no controller, no bus",
                                                    interface, link.kind)});
    return findings;
  }
  if (link.up) findings.push_back(state_finding(interface, *link.state));
  if (link.bitrate_hz > 0) {
    findings.push_back({Verdict::kGood, fmt::format("{}: {} bit/s", interface, link.bitrate_hz)});
  }
  if (link.restart_ms == 0) {
    findings.push_back(
        {Verdict::kWarning,
         fmt::format("{}: does not come back by itself after bus-off; set RestartSec=100ms in its "
                     ".network file or 'ip link set {} type can restart-ms 100' while it is down",
                     interface, interface)});
  } else {
    findings.push_back({Verdict::kGood, fmt::format("{}: back on the bus {} ms after bus-off",
                                                    interface, link.restart_ms)});
  }
  return findings;
}

bool any_bad(const std::vector<SetupFinding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const auto& finding) { return finding.verdict == Verdict::kBad; });
}

}  // namespace ravencal::quadrature_reader
