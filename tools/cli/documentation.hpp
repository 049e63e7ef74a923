// SPDX-License-Identifier: Apache-2.0
//
// Man pages and bash completion, made by a program from the same tree of commands and options that
// --help prints, so that all agree.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}

namespace ravencal::cli {

/// Adds the hidden options `--write-man FOLDER` and `--write-completion FILE`, with which a build
/// asks `app`, known as `program`, for its documentation, and `--list-files`, with which tests ask
/// for the options that name files (cli/files.hpp). Call it when every command is there.
void add_documentation(CLI::App& app, const std::string& program);

/// File name ("ravencal-train.1") and text of one man page for the program and for each command.
std::vector<std::pair<std::string, std::string>> man_pages(const CLI::App& app,
                                                           const std::string& program);

/// A script for bash-completion: commands, options, and the values of options that have a set.
std::string bash_completion(const CLI::App& app, const std::string& program);

}  // namespace ravencal::cli
