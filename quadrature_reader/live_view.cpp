// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/live_view.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <numbers>

namespace ravencal::quadrature_reader {

std::string advice_on_zeros(const std::vector<std::string>& joints) {
  return fmt::format(
      "counts without a position, because the zero is unknown: {}; --home finds it while the robot "
      "homes, --pose JOINT=VALUE gives it",
      fmt::join(joints, ", "));
}

std::string losses_in(const LoggerStatus& status) {
  std::vector<std::string> joints;
  for (const auto& joint : status.joints) {
    if (joint.losses > 0) joints.push_back(fmt::format("{} {} times", joint.name, joint.losses));
  }
  if (joints.empty()) return {};
  return fmt::format("data was lost: {}; the events of the recording say when and how much",
                     fmt::join(joints, ", "));
}

std::string table_of(const LoggerStatus& status) {
  std::string text = fmt::format("{:<12}{:>14}{:>16}{:>16}{:>11}{:>8}  {}\n", "joint", "counts",
                                 "position", "velocity", "edges/s", "losses", "state");
  for (const auto& joint : status.joints) {
    const bool revolute = joint.unit == "rad";
    const double display = revolute ? 180.0 / std::numbers::pi : 1000.0;
    const char* unit = revolute ? "deg" : "mm";
    const std::string position =
        joint.sample.position_valid
            ? fmt::format("{:.3f} {}", display * joint.sample.position_si, unit)
            : "unknown";
    const std::string velocity =
        joint.sample.counts_valid
            ? fmt::format("{:.3f} {}/s", display * joint.sample.velocity_si, unit)
            : "unknown";
    text += fmt::format("{:<12}{:>14}{:>16}{:>16}{:>11.0f}{:>8}  {}\n", joint.name, joint.count,
                        position, velocity, joint.edges_per_s, joint.losses,
                        joint.delivering ? "ok" : "SILENT");
  }
  text += fmt::format("{:.1f} s, {} rows, buffer at most {:.1f} % full{}{}\n", status.elapsed_s,
                      status.rows, 100.0 * status.fullest_ring,
                      status.trouble.empty() ? "" : "\ntrouble: ", status.trouble);
  if (!status.to_be_homed.empty()) {
    text += fmt::format("waiting for the hard stop of: {}\n", fmt::join(status.to_be_homed, ", "));
  } else if (!status.without_zero.empty()) {
    text += advice_on_zeros(status.without_zero) + "\n";
  }
  return text;
}

std::string json_of(const LoggerStatus& status) {
  nlohmann::ordered_json line;
  line["elapsed_s"] = status.elapsed_s;
  line["ended"] = status.ended;
  line["rows"] = status.rows;
  line["fullest_ring"] = status.fullest_ring;
  line["to_be_homed"] = status.to_be_homed;
  line["without_zero"] = status.without_zero;
  line["trouble"] =
      status.trouble.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(status.trouble);
  for (const auto& joint : status.joints) {
    nlohmann::ordered_json entry{
        {"joint", joint.name}, {"unit", joint.unit}, {"counts", joint.count}};
    entry["position"] = joint.sample.position_valid
                            ? nlohmann::ordered_json(joint.sample.position_si)
                            : nlohmann::ordered_json();
    entry["velocity"] = joint.sample.counts_valid ? nlohmann::ordered_json(joint.sample.velocity_si)
                                                  : nlohmann::ordered_json();
    entry["edges"] = joint.edges;
    entry["edges_per_s"] = joint.edges_per_s;
    entry["losses"] = joint.losses;
    entry["delivering"] = joint.delivering;
    line["joints"].push_back(std::move(entry));
  }
  return line.dump();
}

}  // namespace ravencal::quadrature_reader
