// SPDX-License-Identifier: Apache-2.0
//
// Words on a command line: options whose value is one of a few, commands that were mistyped.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

namespace ravencal::cli {

/// Lets `value` be one of `words` and shows just these in help, errors and completion.
template <typename Value>
CLI::Option* add_words(CLI::App& command, const std::string& name, Value& value,
                       const std::vector<std::pair<std::string, Value>>& words,
                       const std::string& description) {
  std::vector<std::string> known;
  for (const auto& word : words) known.push_back(word.first);
  return command
      .add_option_function<std::string>(
          name,
          [&value, words](const std::string& said) {
            for (const auto& [word, meaning] : words) {
              if (word == said) value = meaning;
            }
          },
          description)
      ->check(CLI::IsMember(known));
}

/// Prints what is wrong with the command line, behind the names of program and command, or the help
/// that was asked for; the exit code. A word in the place of a command is named, with the command
/// that was likely meant.
int explain(const CLI::App& app, const CLI::ParseError& error);

}  // namespace ravencal::cli
