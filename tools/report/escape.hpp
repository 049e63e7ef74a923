// SPDX-License-Identifier: Apache-2.0
//
// Text from recordings and users goes into the page as text, whatever it contains.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace ravencal::report {

/// Text as HTML content or attribute value. Bytes that are not UTF-8 are the caller's problem: a
/// browser shows a replacement character.
std::string html_escape(std::string_view text);

/// JSON that may stand inside a <script> element: no "<" survives, so nothing can close it.
std::string script_json(const nlohmann::json& value);
/// The same of JSON that is text already.
std::string script_text(std::string_view plain);

/// Replaces each {{name}} of the template by its value, in one pass: a value that contains {{...}}
/// stays as it is. Every placeholder must have a value.
std::string fill_template(std::string_view text,
                          const std::vector<std::pair<std::string_view, std::string_view>>& values);

}  // namespace ravencal::report
