// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/setup_check.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "quadrature_reader/axis.hpp"
#include "quadrature_reader/setup_device.hpp"
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
    report(realtime_findings());
    for (std::size_t i = 0; i < config_.sources.size() && !stop_(); ++i) check_source(i, options);
    for (const auto& encoder : config_.encoders) check_zero(encoder);
    return good_;
  }

 private:
  void report(Verdict verdict, const std::string& text) {
    good_ = good_ && verdict != Verdict::kBad;
    say_({verdict, text});
  }

  /// False if one of the findings is bad.
  bool report(const std::vector<SetupFinding>& findings) {
    for (const auto& finding : findings) report(finding.verdict, finding.text);
    return !any_bad(findings);
  }

  /// False if the device cannot be used as it stands.
  bool check_device(const SourceSettings& settings) {
    switch (settings.kind) {
      case SourceKind::kGpio:
      case SourceKind::kCounter:
        return report({device_file_finding(settings.device)});
      case SourceKind::kCan: {
        const auto link = read_can_link(settings.device);
        if (link.ok()) return report(can_findings(settings.device, *link));
        report(Verdict::kBad, link.error().message +
                                  "; is the adapter plugged in, are the udev rules installed "
                                  "(udev/README.md)?");
        return false;
      }
      case SourceKind::kReplay:
        return true;
    }
    return true;
  }

  void check_source(std::size_t number, const SetupOptions& options) {
    const SourceSettings& settings = config_.sources[number];
    if (!check_device(settings)) return;
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
        if (reading.kind == ReadingKind::kNotice) report_stamps(reading.fault);
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

  void report_stamps(Fault whose) {
    if (whose == Fault::kStampsHardware) {
      report(Verdict::kGood, "frames bear the adapter's own time stamps");
    } else if (whose == Fault::kStampsKernel) {
      report(Verdict::kGood, "frames bear the kernel's time stamps, the adapter gives none");
    } else if (whose == Fault::kStampsArrival) {
      report(Verdict::kWarning,
             "frames bear no time stamp: they get the time at which they are read, late by the "
             "machine's scheduling");
    }
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
