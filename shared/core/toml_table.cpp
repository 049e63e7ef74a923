// SPDX-License-Identifier: Apache-2.0
#include "core/toml_table.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/whole_file.hpp"

namespace ravencal::core {
namespace {

Error error_at(const std::string& source, const toml::source_position& where,
               std::string_view message) {
  return {ErrorCode::kData,
          fmt::format("{}:{}: {} (column {})", source, where.line, message, where.column)};
}

/// toml++ itself would read true as 1.
std::optional<double> finite_number(const toml::node& node) {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::vector<double>> finite_numbers(const toml::node* node, std::size_t count) {
  const toml::array* list = node != nullptr ? node->as_array() : nullptr;
  if (list == nullptr || list->size() != count) return std::nullopt;
  std::vector<double> values;
  for (const toml::node& element : *list) {
    const auto value = finite_number(element);
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

bool is_within(double value, NumberRange range) {
  return value >= range.low && value <= range.high;
}

std::optional<std::string> word_of(const toml::node& node) {
  if (node.is_number()) return fmt::format("{}", *node.value<double>());
  return node.value<std::string>();
}

/// The library limits how deep values nest, but not how many tables a dotted key opens one within
/// the other; each costs it calls on the stack.
constexpr int kMostDots = 32;

/// Past a text that begins at `at`, of one line or of several; past its line if that never ends.
std::size_t past_text(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const std::string three(3, quote);
  const bool long_form = text.substr(at, 3) == three;
  for (at += long_form ? 3 : 1; at < text.size(); ++at) {
    if (text[at] == '\n' && !long_form) return at;
    if (text[at] == '\\' && quote == '"') {
      ++at;
    } else if (!long_form && text[at] == quote) {
      return at + 1;
    } else if (long_form && text.substr(at, 3) == three) {
      at = text.find_first_not_of(quote, at);
      return std::min(at, text.size());
    }
  }
  return text.size();
}

/// The first line with a longer key, from 1; 0: none.
std::size_t line_of_long_key(std::string_view text) {
  int dots = 0;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      at = past_text(text, at);
    } else if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else {
      if (std::string_view("\n,=[]{}").find(c) != std::string_view::npos) dots = 0;
      if (c == '.' && ++dots > kMostDots)
        return 1 + static_cast<std::size_t>(std::count(text.begin(), text.begin() + at, '\n'));
      ++at;
    }
  }
  return 0;
}

}  // namespace

struct TomlTable::State {
  std::shared_ptr<const toml::table> document;  ///< owns `table`
  const toml::table* table = nullptr;
  std::string source;  ///< the file's name in errors
  std::string path;    ///< keys from the root, with dots; empty at the root
  std::string name;    ///< as a user writes it: [a.b], [[a]]
  std::set<std::string, std::less<>> known;
  std::optional<Error> error;

  /// The value of that key, if present; marks the key as known.
  const toml::node* take(std::string_view key) {
    known.emplace(key);
    return table->get(key);
  }
  void fail_at(const toml::node& node, std::string_view message) {
    if (!error) error = error_at(source, node.source().begin, message);
  }
  [[nodiscard]] TomlTable child(const toml::table& inner, std::string_view key,
                                const char* form) const {
    auto state = std::make_unique<State>();
    state->document = document;
    state->table = &inner;
    state->source = source;
    state->path = path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
    state->name = fmt::format(fmt::runtime(form), state->path);
    return TomlTable(std::move(state));
  }
};

TomlTable::TomlTable(std::unique_ptr<State> state) : state_(std::move(state)) {}
TomlTable::TomlTable(TomlTable&& other) noexcept = default;
TomlTable& TomlTable::operator=(TomlTable&& other) noexcept = default;
TomlTable::~TomlTable() = default;

std::optional<double> TomlTable::find_number(std::string_view key, NumberRange range) {
  const toml::node* node = state_->take(key);
  if (node == nullptr) return std::nullopt;
  const auto value = finite_number(*node);
  if (!value) {
    fail(key, fmt::format("{} must be a finite number", key));
  } else if (is_within(*value, range)) {
    return value;
  } else {
    check_range(key, {*value}, range);
  }
  return std::nullopt;
}

double TomlTable::number(std::string_view key, NumberRange range) {
  const auto value = find_number(key, range);
  if (!value && !has(key)) fail_missing(key);
  return value.value_or(0.0);
}

double TomlTable::number_or(std::string_view key, double fallback, NumberRange range) {
  return find_number(key, range).value_or(fallback);
}

std::optional<std::int64_t> TomlTable::find_integer(std::string_view key, IntegerRange range) {
  const toml::node* node = state_->take(key);
  if (node == nullptr) return std::nullopt;
  const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
  if (value && *value >= range.low && *value <= range.high) return value;
  const IntegerRange any;
  std::string wanted = fmt::format("{} must be a whole number", key);
  if (range.low != any.low) wanted += fmt::format(" from {}", range.low);
  if (range.high != any.high) wanted += fmt::format(" to {}", range.high);
  fail(key, wanted);
  return std::nullopt;
}

std::int64_t TomlTable::integer_or(std::string_view key, std::int64_t fallback,
                                   IntegerRange range) {
  return find_integer(key, range).value_or(fallback);
}

bool TomlTable::boolean_or(std::string_view key, bool fallback) {
  const toml::node* node = state_->take(key);
  if (node == nullptr) return fallback;
  if (!node->is_boolean()) {
    fail(key, fmt::format("{} must be true or false", key));
    return fallback;
  }
  return *node->value<bool>();
}

std::optional<std::string> TomlTable::find_text(std::string_view key) {
  const toml::node* node = state_->take(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) fail(key, fmt::format("{} must be a text", key));
  return node->value<std::string>();
}

std::string TomlTable::text(std::string_view key) {
  auto value = find_text(key);
  if (!value && !has(key)) fail_missing(key);
  return std::move(value).value_or("");
}

std::string TomlTable::text_or(std::string_view key, std::string_view fallback) {
  return find_text(key).value_or(std::string(fallback));
}

std::vector<double> TomlTable::numbers(std::string_view key, std::size_t count, NumberRange range) {
  if (auto values = finite_numbers(state_->take(key), count)) {
    check_range(key, *values, range);
    return *std::move(values);
  }
  fail(key, fmt::format("{} must be a list of {} numbers", key, count));
  return std::vector<double>(count, 0.0);
}

std::vector<std::vector<double>> TomlTable::matrix(std::string_view key, std::size_t size,
                                                   NumberRange range) {
  std::vector<std::vector<double>> rows;
  const toml::node* node = state_->take(key);
  const toml::array* list = node != nullptr ? node->as_array() : nullptr;
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    if (auto row = finite_numbers(list->get(i), size)) rows.push_back(*std::move(row));
  }
  for (const auto& row : rows) check_range(key, row, range);
  if (list != nullptr && list->size() == size && rows.size() == size) return rows;
  fail(key, fmt::format("{} must be {} rows of {} numbers", key, size, size));
  return {size, std::vector<double>(size, 0.0)};
}

std::vector<std::string> TomlTable::words(std::string_view key) {
  std::vector<std::string> words;
  const toml::node* node = state_->take(key);
  if (node == nullptr) {
    fail_missing(key);
    return words;
  }
  const auto add = [&](const toml::node& item) {
    if (auto word = word_of(item)) {
      words.push_back(*std::move(word));
    } else {
      state_->fail_at(item, fmt::format("{} must hold numbers or texts", key));
    }
  };
  if (const toml::array* list = node->as_array()) {
    for (const toml::node& item : *list) add(item);
    if (list->empty()) fail(key, fmt::format("{} is empty", key));
  } else {
    add(*node);
  }
  return words;
}

std::optional<TomlTable> TomlTable::table(std::string_view key) {
  const toml::node* node = state_->take(key);
  if (node == nullptr) return std::nullopt;
  if (const toml::table* inner = node->as_table()) return state_->child(*inner, key, "[{}]");
  fail(key, fmt::format("{} must be a table", key));
  return std::nullopt;
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) {
  std::vector<TomlTable> result;
  const toml::node* node = state_->take(key);
  if (node == nullptr) return result;
  const toml::array* list = node->as_array();
  if (list == nullptr || !list->is_homogeneous<toml::table>()) {
    fail(key, fmt::format("write [[{}]] tables", key));
    return result;
  }
  for (const toml::node& element : *list) {
    result.push_back(state_->child(*element.as_table(), key, "[[{}]]"));
  }
  return result;
}

bool TomlTable::has(std::string_view key) const { return state_->table->contains(key); }

bool TomlTable::holds_text(std::string_view key) const {
  const toml::node* node = state_->table->get(key);
  return node != nullptr && node->is_string();
}

bool TomlTable::holds_integer(std::string_view key) const {
  const toml::node* node = state_->table->get(key);
  return node != nullptr && node->is_integer();
}

std::vector<std::string> TomlTable::unread_keys() const {
  std::vector<std::string> keys;
  for (const auto& [key, node] : *state_->table) {
    if (!state_->known.contains(key.str())) keys.emplace_back(key.str());
  }
  return keys;
}

void TomlTable::fail(std::string_view key, std::string_view message) {
  const toml::node* node = state_->table->get(key);
  state_->fail_at(node != nullptr ? *node : *state_->table, message);
}

void TomlTable::fail(std::string_view message) { state_->fail_at(*state_->table, message); }

void TomlTable::check_range(std::string_view key, const std::vector<double>& values,
                            NumberRange range) {
  for (const double value : values) {
    if (is_within(value, range)) continue;
    fail(key, fmt::format("{} is {}, must be from {} to {}", key, value, range.low, range.high));
  }
}

void TomlTable::fail_missing(std::string_view key) {
  fail(fmt::format("{} is missing in {}", key, state_->name));
}

bool TomlTable::failed() const { return state_->error.has_value(); }

Status TomlTable::finish() const {
  if (state_->error) return *state_->error;
  for (const auto& [key, node] : *state_->table) {
    if (state_->known.contains(key.str())) continue;
    return error_at(state_->source, node.source().begin,
                    fmt::format("unknown key '{}' in {}; known: {}", key.str(), state_->name,
                                fmt::join(state_->known, ", ")));
  }
  return {};
}

Result<TomlTable> parse_toml(std::string_view text, const std::string& source,
                             std::string_view name) {
  if (const std::size_t line = line_of_long_key(text); line > 0) {
    return data_error(fmt::format("{}:{}: a key of more than {} dots; no table of {} nests as deep",
                                  source, line, kMostDots, name));
  }
  auto state = std::make_unique<TomlTable::State>();
  try {
    state->document = std::make_shared<const toml::table>(toml::parse(text, source));
  } catch (const toml::parse_error& error) {
    return error_at(source, error.source().begin,
                    fmt::format("{} is TOML, this is not: {}", name, error.description()));
  }
  state->table = state->document.get();
  state->source = source;
  state->name = name;
  return TomlTable(std::move(state));
}

Result<TomlTable> read_toml(const std::filesystem::path& path, std::string_view name) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, read_whole_file(path));
  return parse_toml(text, path.string(), name);
}

std::string toml_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (code < 0x20 || code == 0x7f) {
      out += fmt::format("\\u{:04x}", code);
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string toml_key(std::string_view key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  return bare ? std::string(key) : toml_text(key);
}

}  // namespace ravencal::core
