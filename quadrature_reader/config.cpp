// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/config.hpp"

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "quadrature_reader/config_sources.hpp"
#include "quadrature_reader/toml_table.hpp"

namespace ravencal::quadrature_reader {
namespace fs = std::filesystem;
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kMetresPerMm = 1e-3;

class ConfigReader {
 public:
  explicit ConfigReader(const fs::path& path) : path_(path) { config_.path = path; }

  core::Result<Config> read(const toml::table& root) {
    TomlTable table(root, "the configuration", path_);
    if (const auto* recording = table.table("recording"))
      RAVENCAL_RETURN_IF_ERROR(read_recording(*recording));
    RAVENCAL_RETURN_IF_ERROR(read_tables(table, "source", &ConfigReader::read_source));
    RAVENCAL_RETURN_IF_ERROR(read_tables(table, "encoder", &ConfigReader::read_encoder));
    RAVENCAL_RETURN_IF_ERROR(table.finish());
    return config_;
  }

 private:
  using TableFunction = core::Status (ConfigReader::*)(const toml::table&);

  core::Status read_tables(TomlTable& root, std::string_view key, TableFunction read_one) {
    const toml::node* node = root.find(key);
    const toml::array* array = node == nullptr ? nullptr : node->as_array();
    if (array == nullptr || array->empty()) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: needs at least one [[{}]]", path_.string(), key)};
    }
    for (const auto& element : *array) {
      if (!element.is_table()) {
        root.fail(key, fmt::format("{} must be written as [[{}]] tables", key, key));
        return root.finish();
      }
      RAVENCAL_RETURN_IF_ERROR((this->*read_one)(*element.as_table()));
    }
    return {};
  }

  core::Status read_recording(const toml::table& node) {
    TomlTable table(node, "[recording]", path_);
    config_.rate_hz = table.number("rate_hz", 1.0, 20'000.0).value_or(config_.rate_hz);
    for (const char* key : {"robot", "arm", "serial"}) {
      if (const auto value = table.text(key)) config_.meta[key] = *value;
    }
    return table.finish();
  }

  core::Status read_source(const toml::table& node) {
    TomlTable table(node, "[[source]]", path_);
    SourceSettings source = read_source_settings(table);
    for (const auto& other : config_.sources) {
      if (other.name == source.name)
        table.fail("name", fmt::format("two sources are named '{}'", source.name));
    }
    config_.sources.push_back(std::move(source));
    return table.finish();
  }

  core::Status read_encoder(const toml::table& node);
  void read_scale(TomlTable& table, AxisSettings& axis);
  std::optional<double> read_position(TomlTable& table, const std::string& prefix,
                                      const std::string& unit);

  const fs::path& path_;
  Config config_;
};

core::Status ConfigReader::read_encoder(const toml::table& node) {
  TomlTable table(node, "[[encoder]]", path_);
  EncoderSettings encoder;
  AxisSettings& axis = encoder.axis;
  const auto joint = table.text("joint");
  table.require(joint.has_value(), "joint");
  axis.joint = joint.value_or("");
  for (const auto& other : config_.encoders) {
    if (other.axis.joint == axis.joint)
      table.fail("joint", fmt::format("joint '{}' has two encoders", axis.joint));
  }
  read_scale(table, axis);
  const auto sign = table.integer("sign", -1, 1);
  if (sign && *sign == 0) table.fail("sign", "sign must be 1 or -1");
  axis.sign = static_cast<int>(sign.value_or(1));
  axis.zero_counts = table.integer("zero_counts", INT64_MIN, INT64_MAX);
  axis.zero_position_si = read_position(table, "zero_position", axis.unit).value_or(0.0);
  axis.shortest_pulse_ns =
      std::llround(1e3 * table.number("shortest_pulse_us", 0.0, 1e4).value_or(0.0));
  axis.latency_ns = std::llround(1e6 * table.number("latency_ms", 1.0, 1000.0).value_or(20.0));
  axis.max_uncertainty_counts =
      table.integer("max_uncertainty_counts", 0, INT64_MAX).value_or(axis.max_uncertainty_counts);
  if (const auto counts = table.integer("index_counts", 4, 1'000'000'000)) {
    axis.index =
        IndexSettings{*counts, table.integer("index_tolerance_counts", 0, 1000).value_or(2)};
  }
  if (const auto stop = table.text("stop")) {
    if (*stop != "max" && *stop != "min") table.fail("stop", "stop must be \"max\" or \"min\"");
    const auto position = read_position(table, "stop_position", axis.unit);
    table.require(position.has_value(),
                  axis.unit == "rad" ? "stop_position_deg" : "stop_position_mm");
    encoder.stop = StopSettings{*stop == "max", position.value_or(0.0)};
  }
  const auto source_name = table.text("source");
  table.require(source_name.has_value(), "source");
  for (encoder.source = 0; encoder.source < config_.sources.size(); ++encoder.source) {
    if (config_.sources[encoder.source].name == source_name.value_or("")) break;
  }
  if (encoder.source == config_.sources.size()) {
    table.fail("source",
               fmt::format("there is no [[source]] named '{}'", source_name.value_or("")));
    return table.finish();
  }
  const auto number = static_cast<std::uint8_t>(config_.encoders.size());
  if (config_.encoders.size() >= kEveryAxis) table.fail("joint", "too many encoders");
  read_wiring(table, number, config_.sources[encoder.source], axis);
  config_.encoders.push_back(std::move(encoder));
  return table.finish();
}

void ConfigReader::read_scale(TomlTable& table, AxisSettings& axis) {
  const auto per_rev = table.integer("counts_per_rev", 1, 1'000'000'000);
  const auto um = table.number("um_per_count", 1e-6, 1e6);
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

std::optional<double> ConfigReader::read_position(TomlTable& table, const std::string& prefix,
                                                  const std::string& unit) {
  const auto value = table.number(prefix + (unit == "rad" ? "_deg" : "_mm"), -1e6, 1e6);
  if (!value) return std::nullopt;
  return *value * (unit == "rad" ? kRadPerDeg : kMetresPerMm);
}

}  // namespace

std::string_view name_of(SourceKind kind) {
  switch (kind) {
    case SourceKind::kGpio:
      return "gpio";
    case SourceKind::kCan:
      return "can";
    case SourceKind::kReplay:
      return "replay";
  }
  return "unknown";
}

core::Result<Config> parse_config(std::string_view text, const fs::path& path) {
  try {
    return ConfigReader(path).read(toml::parse(text, path.string()));
  } catch (const toml::parse_error& error) {
    const auto& where = error.source().begin;
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}:{}:{}: {}", path.string(), where.line, where.column, error.description())};
  }
}

core::Result<Config> load_config(const fs::path& path) {
  std::ifstream stream(path);
  if (!stream)
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot open it", path.string())};
  std::stringstream text;
  text << stream.rdbuf();
  return parse_config(text.str(), path);
}

}  // namespace ravencal::quadrature_reader
