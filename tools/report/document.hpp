// SPDX-License-Identifier: Apache-2.0
//
// One HTML document that opens offline, as it grows: sections for the list of contents, charts for
// the script. Every page of the program is one of these, so all have one look and one set of rules.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace ravencal::report {

/// What stands above the contents; text, not HTML. Empty parts are left out.
struct DocumentHead {
  std::string title;
  std::string subtitle;
  std::string verdict;  ///< one or two plain sentences
};

/// One line of a list of class "key": a stroke as the charts draw it and what it means.
std::string key_item_html(const char* colour, const char* dash, double width,
                          const std::string& html);

/// A page of nothing but data, which `script` draws with draw.js. A reader without scripts is sent
/// to `data_files`, which hold the same beside the page.
std::string drawn_html(const std::string& title, const std::string& data_json,
                       const std::string& data_files, std::string_view script);

class Document {
 public:
  void section(const std::string& id, const std::string& title);
  /// HTML, already escaped.
  void add(const std::string& html) { body_ += html; }
  /// Text below a table.
  void note(const std::string& text);
  /// Rows of name and value and the shell commands that make the page again, as the last section;
  /// nothing if both are empty.
  void provenance(const std::vector<std::pair<std::string, std::string>>& facts,
                  const std::string& reproduce);
  /// A chart under a heading, with a caption that says what cannot be seen; both are text, the
  /// caption may be empty. A wide one takes the whole line.
  void figure(const nlohmann::json& spec, const std::string& heading, const std::string& caption,
              bool wide);

  /// The whole page.
  [[nodiscard]] std::string html(const DocumentHead& head) const;

 private:
  std::string body_;
  std::string charts_;  ///< members of a JSON array
  std::size_t chart_count_ = 0;
  std::vector<std::pair<std::string, std::string>> sections_;  ///< id, title
};

}  // namespace ravencal::report
