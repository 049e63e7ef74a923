// SPDX-License-Identifier: Apache-2.0
#include "report/escape.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "core/require.hpp"

namespace ravencal::report {

std::string html_escape(std::string_view text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string script_json(const nlohmann::json& value) {
  return script_text(value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

std::string script_text(std::string_view plain) {
  std::string escaped;
  escaped.reserve(plain.size());
  for (const char c : plain) {
    // "<" occurs in JSON inside strings only, where \u003c means the same.
    if (c == '<') {
      escaped += "\\u003c";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string fill_template(
    std::string_view text,
    const std::vector<std::pair<std::string_view, std::string_view>>& values) {
  std::string filled;
  while (true) {
    const std::size_t open = text.find("{{");
    filled += text.substr(0, open);
    if (open == std::string_view::npos) return filled;
    const std::size_t close = text.find("}}", open);
    core::require(close != std::string_view::npos, "a {{ of a page's template has no }}");
    const std::string_view name = text.substr(open + 2, close - open - 2);
    const auto value = std::find_if(values.begin(), values.end(),
                                    [name](const auto& entry) { return entry.first == name; });
    core::require(value != values.end(), "a page's template asks for a value that it is not given");
    filled += value->second;
    text.remove_prefix(close + 2);
  }
}

}  // namespace ravencal::report
