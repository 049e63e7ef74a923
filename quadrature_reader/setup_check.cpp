// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/setup_check.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "quadrature_reader/axis.hpp"
#include "quadrature_reader/sources/source.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr std::int64_t kListenNs = 1'500'000'000;  // longer than the sources' own level check
constexpr std::int64_t kWiggleCounts = 200;        // 0.9 deg of an AEDA-3300, 1 mm of a Mercury II

class SetupCheck {
 public:
  SetupCheck(const Config& config, const std::function<void(const SetupFinding&)>& say,
             const std::function<bool()>& stop)
      : config_(config), say_(say), stop_(stop) {
    for (const auto& encoder : config.encoders) axes_.emplace_back(encoder.axis);
  }

  bool run(const SetupOptions& options) {
    check_realtime_limit();
    for (std::size_t i = 0; i < config_.sources.size() && !stop_(); ++i) check_source(i, options);
    for (const auto& encoder : config_.encoders) check_zero(encoder);
    return good_;
  }

 private:
  void report(Verdict verdict, const std::string& text) {
    good_ = good_ && verdict != Verdict::kBad;
    say_({verdict, text});
  }

  void check_realtime_limit() {
    rlimit limit{};
    getrlimit(RLIMIT_RTPRIO, &limit);
    if (geteuid() == 0 || limit.rlim_cur > 0) {
      report(Verdict::kGood, "real-time scheduling is permitted (--realtime-priority)");
    } else {
      report(Verdict::kWarning,
             "real-time scheduling is not permitted: a busy machine may overflow the kernel's "
             "event queue; add "
             "'@ravencal - rtprio 50' to /etc/security/limits.d/ravencal.conf or use the systemd "
             "unit");
    }
  }

  /// False if the device file cannot be used.
  bool check_device_file(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) {
      report(Verdict::kBad,
             fmt::format("{}: {}; is the device plugged in, are the udev rules installed "
                         "(udev/README.md)?",
                         path, std::strerror(errno)));
      return false;
    }
    const group* owner = getgrgid(status.st_gid);
    const std::string name = owner != nullptr ? owner->gr_name : fmt::format("{}", status.st_gid);
    const std::string found =
        fmt::format("{}: group {}, mode {:o}", path, name, status.st_mode & 0777U);
    if (::access(path.c_str(), R_OK | W_OK) != 0) {
      report(Verdict::kBad,
             fmt::format("{}: you may not use it; run 'sudo usermod -aG {} $USER' and log in again",
                         found, name));
      return false;
    }
    report(Verdict::kGood, found);
    return true;
  }

  void check_source(std::size_t number, const SetupOptions& options) {
    const SourceSettings& settings = config_.sources[number];
    if (settings.kind == SourceKind::kGpio && !check_device_file(settings.device)) return;
    auto source = make_source(settings);
    if (!source.ok()) return report(Verdict::kBad, source.error().message);
    if (const auto status = (*source)->open(); !status.ok())
      return report(Verdict::kBad, status.error().message);
    report(Verdict::kGood, fmt::format("source '{}': {} opens", settings.name, settings.device));
    if (!listen(**source, kListenNs, [] { return false; })) return;
    for (std::size_t i = 0; i < axes_.size() && !stop_(); ++i) {
      if (config_.encoders[i].source != number) continue;
      report_state(i, settings);
      if (options.wiggle && settings.kind != SourceKind::kReplay)
        wiggle(i, **source, options.wiggle_s);
    }
  }

  /// Feeds the axes for `duration_ns` or until `done`. False if the device failed.
  bool listen(Source& source, std::int64_t duration_ns, const std::function<bool()>& done) {
    const std::int64_t until_ns = monotonic_now_ns() + duration_ns;
    std::vector<Reading> readings;
    AxisUpdate update;
    while (monotonic_now_ns() < until_ns && !stop_() && !done() && !source.finished()) {
      readings.clear();
      const auto status = source.read(readings, std::chrono::milliseconds(10));
      for (const auto& reading : readings) {
        if (reading.axis == kEveryAxis) continue;
        Axis& axis = axes_[reading.axis];
        axis.push(reading);
        while (axis.pop(update)) levels_[reading.axis] = update.levels;
      }
      if (!status.ok()) {
        report(Verdict::kBad, status.error().message);
        return false;
      }
    }
    return true;
  }

  void report_state(std::size_t number, const SourceSettings& settings) {
    const Axis& axis = axes_[number];
    const std::string joint = axis.settings().joint;
    if (!axis.delivering()) {
      report(Verdict::kBad, settings.kind == SourceKind::kCan
                                ? fmt::format("joint '{}': no position frame within {:.1f} s; "
                                              "check id, bit rate and power of the node",
                                              joint, 1e-9 * static_cast<double>(kListenNs))
                                : fmt::format("joint '{}': its lines cannot be read", joint));
      return;
    }
    const unsigned levels = levels_[number];
    const std::string lines =
        settings.kind == SourceKind::kGpio
            ? fmt::format(", A={} B={} Z={}", levels & 1U, (levels >> 1U) & 1U, (levels >> 2U) & 1U)
            : "";
    report(axis.losses() == 0 ? Verdict::kGood : Verdict::kWarning,
           fmt::format("joint '{}': count {}{}, {} edges and {} losses while listening", joint,
                       axis.count(), lines, axis.edges(), axis.losses()));
  }

  void wiggle(std::size_t number, Source& source, double patience_s) {
    const Axis& axis = axes_[number];
    const std::string joint = axis.settings().joint;
    const std::int64_t start = axis.count();
    report(Verdict::kGood,
           fmt::format("joint '{}': move it by hand in its positive direction, by a degree or a "
                       "millimetre or more (waiting {:.0f} s)",
                       joint, patience_s));
    const auto moved = [&] { return std::abs(axis.count() - start) >= kWiggleCounts; };
    if (!listen(source, static_cast<std::int64_t>(1e9 * patience_s), moved)) return;
    const std::int64_t counts = axis.count() - start;
    if (!moved()) {
      report(Verdict::kBad,
             fmt::format("joint '{}': moved by {} counts only; check wiring and power", joint,
                         counts));
    } else if (counts * axis.settings().sign > 0) {
      report(Verdict::kGood, fmt::format("joint '{}': {:+} counts, sign {:+} is right", joint,
                                         counts, axis.settings().sign));
    } else {
      report(Verdict::kBad,
             fmt::format("joint '{}': {:+} counts with sign {:+}: if you moved it in its positive "
                         "direction, set sign = {}",
                         joint, counts, axis.settings().sign, -axis.settings().sign));
    }
  }

  void check_zero(const EncoderSettings& encoder) {
    if (encoder.axis.zero_counts || encoder.stop) return;
    report(Verdict::kWarning,
           fmt::format("joint '{}': has neither zero_counts nor a stop: its position stays unknown "
                       "unless you give --pose",
                       encoder.axis.joint));
  }

  const Config& config_;
  const std::function<void(const SetupFinding&)>& say_;
  const std::function<bool()>& stop_;
  std::vector<Axis> axes_;
  std::map<std::size_t, unsigned> levels_;
  bool good_ = true;
};

}  // namespace

bool check_setup(const Config& config, const SetupOptions& options,
                 const std::function<void(const SetupFinding&)>& say,
                 const std::function<bool()>& stop) {
  return SetupCheck(config, say, stop).run(options);
}

}  // namespace ravencal::quadrature_reader
