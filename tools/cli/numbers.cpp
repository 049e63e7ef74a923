// SPDX-License-Identifier: Apache-2.0
#include "cli/numbers.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <system_error>

namespace ravencal::cli {
namespace {

// Each says what is wrong. A text that is no number at all passes: CLI11 refuses it.

std::optional<double> real_of(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0') return std::nullopt;
  return value;
}

std::string flaw_of_real(std::string& text) {
  const std::optional<double> value = real_of(text);
  if (!value || std::abs(*value) <= kLargestNumber) return {};
  return fmt::format("{} is no number from {:g} to {:g}", text, -kLargestNumber, kLargestNumber);
}

template <typename Whole>
std::string flaw_of_whole(std::string& text) {
  Whole value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool has_sign = text.starts_with('-') && Whole(-1) > Whole(0);
  if (!has_sign && result.ec != std::errc::result_out_of_range) return {};
  return fmt::format("{} is no whole number from {} to {}", text, std::numeric_limits<Whole>::min(),
                     std::numeric_limits<Whole>::max());
}

void check(CLI::Option& option) {
  const std::string type = option.get_type_name();
  std::string (*flaw)(std::string&) = nullptr;
  if (type.starts_with("FLOAT")) flaw = flaw_of_real;
  if (type.starts_with("INT")) flaw = flaw_of_whole<std::int64_t>;
  if (type.starts_with("UINT")) flaw = flaw_of_whole<std::uint64_t>;
  if (flaw != nullptr) option.check(CLI::Validator(flaw, ""));
}

}  // namespace

void check_numbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) check(*option);
  for (CLI::App* command : app.get_subcommands({})) check_numbers(*command);
}

std::optional<std::pair<double, std::string>> leading_number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || !(std::abs(value) <= kLargestNumber)) return std::nullopt;
  return std::pair{value, std::string(end)};
}

CLI::Validator not_negative() {
  const auto flaw = [](std::string& text) {
    const std::optional<double> value = real_of(text);
    return value && *value < 0.0 ? fmt::format("{} is below 0", text) : std::string();
  };
  return {flaw, "NONNEGATIVE"};
}

CLI::Validator positive() {
  const auto flaw = [](std::string& text) {
    const std::optional<double> value = real_of(text);
    return value && *value <= 0.0 ? fmt::format("{} is not above 0", text) : std::string();
  };
  return {flaw, "POSITIVE"};
}

}  // namespace ravencal::cli
