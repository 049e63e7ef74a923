// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/constants.hpp"
#include "core/toml_table.hpp"
#include "core/whole_file.hpp"
#include "quadrature_reader/config_sources.hpp"

namespace ravencal::quadrature_reader {
namespace fs = std::filesystem;
namespace {

using core::TomlTable;

constexpr double kMetresPerMm = 1e-3;

class ConfigReader {
 public:
  explicit ConfigReader(const fs::path& path) { config_.path = path; }

  core::Result<Config> read(TomlTable& root) {
    if (auto recording = root.table("recording")) {
      RAVENCAL_RETURN_IF_ERROR(read_recording(*recording));
    }
    RAVENCAL_RETURN_IF_ERROR(read_tables(root, "source", &ConfigReader::read_source));
    RAVENCAL_RETURN_IF_ERROR(read_tables(root, "encoder", &ConfigReader::read_encoder));
    RAVENCAL_RETURN_IF_ERROR(root.finish());
    return config_;
  }

 private:
  using ReadTable = core::Status (ConfigReader::*)(TomlTable&);

  core::Status read_tables(TomlTable& root, std::string_view key, ReadTable read_one) {
    std::vector<TomlTable> tables = root.tables(key);
    if (root.failed()) return root.finish();
    if (tables.empty()) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: needs at least one [[{}]]", config_.path.string(), key)};
    }
    for (TomlTable& table : tables) RAVENCAL_RETURN_IF_ERROR((this->*read_one)(table));
    return {};
  }

  core::Status read_recording(TomlTable& table) {
    config_.rate_hz = table.number_or("rate_hz", config_.rate_hz, {1.0, 20'000.0});
    for (const char* key : {"robot", "arm", "serial"}) {
      if (const auto value = table.find_text(key)) config_.meta[key] = *value;
    }
    return table.finish();
  }

  core::Status read_source(TomlTable& table) {
    SourceSettings source = read_source_settings(table);
    for (const auto& other : config_.sources) {
      if (other.name == source.name)
        table.fail("name", fmt::format("two sources are named '{}'", source.name));
    }
    config_.sources.push_back(std::move(source));
    return table.finish();
  }

  core::Status read_encoder(TomlTable& table);

  Config config_;
};

void read_scale(TomlTable& table, AxisSettings& axis) {
  const auto per_rev = table.find_integer("counts_per_rev", {1, 1'000'000'000});
  const auto um = table.find_number("um_per_count", {1e-6, 1e6});
  if (per_rev.has_value() == um.has_value()) {
    table.fail(
        "joint",
        fmt::format(
            "encoder '{}' needs either 'counts_per_rev' (revolute, after x4) or 'um_per_count'",
            axis.joint));
  }
  axis.unit = um ? "m" : "rad";
  axis.si_per_count =
      um ? 1e-6 * *um : 2.0 * std::numbers::pi / static_cast<double>(per_rev.value_or(1));
}

/// A position in degrees or millimetres under the key that says so; SI.
std::optional<double> read_position(TomlTable& table, const std::string& key,
                                    const std::string& unit) {
  const auto value = table.find_number(key, {-1e6, 1e6});
  if (!value) return std::nullopt;
  return *value * (unit == "rad" ? core::kRadPerDeg : kMetresPerMm);
}

void read_axis(TomlTable& table, AxisSettings& axis) {
  constexpr std::int64_t kMany = std::numeric_limits<std::int64_t>::max();
  read_scale(table, axis);
  axis.sign = static_cast<int>(table.integer_or("sign", 1, {-1, 1}));
  if (axis.sign == 0) table.fail("sign", "sign must be 1 or -1");
  axis.zero_counts = table.find_integer("zero_counts");
  axis.zero_position_si =
      read_position(table, axis.unit == "rad" ? "zero_position_deg" : "zero_position_mm", axis.unit)
          .value_or(0.0);
  axis.shortest_pulse_ns =
      std::llround(1e3 * table.number_or("shortest_pulse_us", 0.0, {0.0, 1e4}));
  axis.latency_ns = std::llround(1e6 * table.number_or("latency_ms", 20.0, {1.0, 1000.0}));
  axis.max_uncertainty_counts =
      table.integer_or("max_uncertainty_counts", axis.max_uncertainty_counts, {0, kMany});
  if (const auto counts = table.find_integer("index_counts", {4, 1'000'000'000})) {
    axis.index = IndexSettings{*counts, table.integer_or("index_tolerance_counts", 2, {0, 1000})};
  }
}

std::optional<StopSettings> read_stop(TomlTable& table, const AxisSettings& axis) {
  const auto stop = table.find_text("stop");
  if (!stop) return std::nullopt;
  if (*stop != "max" && *stop != "min") table.fail("stop", "stop must be \"max\" or \"min\"");
  const char* key = axis.unit == "rad" ? "stop_position_deg" : "stop_position_mm";
  if (!table.has(key)) table.fail_missing(key);
  return StopSettings{*stop == "max", read_position(table, key, axis.unit).value_or(0.0)};
}

core::Status ConfigReader::read_encoder(TomlTable& table) {
  EncoderSettings encoder;
  encoder.axis.joint = table.text("joint");
  for (const auto& other : config_.encoders) {
    if (other.axis.joint == encoder.axis.joint)
      table.fail("joint", fmt::format("joint '{}' has two encoders", encoder.axis.joint));
  }
  read_axis(table, encoder.axis);
  encoder.stop = read_stop(table, encoder.axis);
  if (!table.boolean_or("plausible", true))
    config_.meta[encoder.axis.joint + ".plausible"] = "false";
  const std::string source_name = table.text("source");
  const auto source =
      std::find_if(config_.sources.begin(), config_.sources.end(),
                   [&](const SourceSettings& each) { return each.name == source_name; });
  if (source == config_.sources.end()) {
    table.fail("source", fmt::format("there is no [[source]] named '{}'", source_name));
    return table.finish();
  }
  encoder.source = static_cast<std::size_t>(source - config_.sources.begin());
  const auto number = static_cast<std::uint8_t>(config_.encoders.size());
  if (config_.encoders.size() >= kEveryAxis) table.fail("joint", "too many encoders");
  read_wiring(table, number, *source, encoder.axis);
  config_.encoders.push_back(std::move(encoder));
  return table.finish();
}

}  // namespace

std::string_view name_of(SourceKind kind) {
  switch (kind) {
    case SourceKind::kGpio:
      return "gpio";
    case SourceKind::kCan:
      return "can";
    case SourceKind::kCounter:
      return "counter";
    case SourceKind::kReplay:
      return "replay";
  }
  return "unknown";
}

core::Result<Config> parse_config(std::string_view text, const fs::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(TomlTable root,
                            core::parse_toml(text, path.string(), "the configuration"));
  return ConfigReader(path).read(root);
}

void replay_instead(Config& config, const fs::path& recording, double speed) {
  SourceSettings replay;
  replay.name = "replay";
  replay.kind = SourceKind::kReplay;
  replay.device = recording.string();
  replay.replay_speed = speed;
  for (std::size_t i = 0; i < config.encoders.size(); ++i) {
    config.encoders[i].source = 0;
    const auto axis = static_cast<std::uint8_t>(i);
    replay.replay_joints[config.encoders[i].axis.joint] = axis;
    replay.replay_limits[axis] = config.encoders[i].axis.limit;
  }
  config.sources = {std::move(replay)};
}

core::Result<Config> load_config(const fs::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  return parse_config(text, path);
}

}  // namespace ravencal::quadrature_reader
