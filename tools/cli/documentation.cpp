// SPDX-License-Identifier: Apache-2.0
#include "cli/documentation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "cli/files.hpp"
#include "core/terminal.hpp"
#include "core/version.hpp"
#include "core/whole_file.hpp"

namespace ravencal::cli {
namespace {

const std::vector<std::string> kExitCodes = {"success", "a finding: a regression or a mismatch",
                                             "wrong usage", "wrong data, or input and output",
                                             "a device"};

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_name().empty(); });
}

/// Without those that --help hides.
std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

/// For roff: neither its escapes nor its requests, and hyphens that can be copied to a shell.
std::string escaped(const std::string& text) {
  std::string result;
  bool starts_line = true;
  for (const char character : text) {
    if (starts_line && (character == '.' || character == '\'')) result += "\\&";
    if (character == '\\') {
      result += "\\e";
    } else if (character == '-') {
      result += "\\-";
    } else {
      result += character;
    }
    starts_line = character == '\n';
  }
  return result;
}

/// "--out", or "NAME" of a positional, with the words for its value: "TEXT:{f32,bf16}".
std::string title_of(const CLI::Option& option) {
  std::string title = "\\fB" + escaped(option.get_name(option.get_positional(), true)) + "\\fR";
  const std::string type = option.get_type_name();
  if (!type.empty() && option.get_type_size() != 0) title += " \\fI" + escaped(type) + "\\fR";
  return title;
}

std::string option_section(const CLI::App& app) {
  std::string page;
  for (const CLI::Option* option : options_of(app)) {
    page += fmt::format(".TP\n{}\n{}", title_of(*option), escaped(option->get_description()));
    if (option->get_required()) page += " (required)";
    if (!option->get_default_str().empty()) {
      page += fmt::format(" [default: {}]", escaped(option->get_default_str()));
    }
    page += "\n";
  }
  return page;
}

std::string synopsis(const CLI::App& app, const std::string& name) {
  std::string text = fmt::format(".B {}\n", escaped(name));
  for (const CLI::Option* option : options_of(app)) {
    if (option->get_positional())
      text += fmt::format("\\fI{}\\fR\n", escaped(option->get_name(true, false)));
  }
  if (!commands_of(app).empty()) text += "\\fICOMMAND\\fR\n";
  return text + "[\\fIOPTIONS\\fR]\n";
}

/// The command and those below it.
std::string command_text(const CLI::App& command, const std::string& name) {
  std::string page = fmt::format(".SH SYNOPSIS\n{}", synopsis(command, name));
  page += fmt::format(".SH DESCRIPTION\n{}\n", escaped(command.get_description()));
  page += fmt::format(".SH OPTIONS\n{}", option_section(command));
  for (const CLI::App* below : commands_of(command)) {
    page += fmt::format(".SH {} {}\n{}\n.PP\n{}{}", escaped(name), escaped(below->get_name()),
                        escaped(below->get_description()),
                        synopsis(*below, name + " " + below->get_name()), option_section(*below));
    if (!below->get_footer().empty()) {
      page += fmt::format(".PP\n.nf\n{}\n.fi\n", escaped(below->get_footer()));
    }
  }
  if (!command.get_footer().empty()) {
    page += fmt::format(".SH EXAMPLES\n.nf\n{}\n.fi\n", escaped(command.get_footer()));
  }
  return page;
}

std::string page_of(const std::string& name, const std::string& title, const std::string& what,
                    const std::string& body, const std::string& see_also) {
  std::string page = fmt::format(".TH \"{}\" 1 \"\" \"ravencal {}\" \"User commands\"\n",
                                 escaped(title), core::kVersion);
  page += fmt::format(".SH NAME\n{} \\- {}\n{}", escaped(name), escaped(what), body);
  page += ".SH EXIT STATUS\n";
  for (std::size_t code = 0; code < kExitCodes.size(); ++code) {
    page += fmt::format(".TP\n.B {}\n{}\n", code, kExitCodes[code]);
  }
  if (!see_also.empty()) page += fmt::format(".SH SEE ALSO\n{}\n", see_also);
  return page;
}

/// The first line: a NAME section has one.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// Options that a shell can complete, and words that their values come from.
struct Words {
  std::vector<std::string> options;
  std::vector<std::pair<std::string, std::string>> values;  ///< "--precision" and "f32 bf16 int8"
};

Words words_of(const CLI::App& app) {
  Words words;
  for (const CLI::Option* option : options_of(app)) {
    std::vector<std::string> names;
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    words.options.insert(words.options.end(), names.begin(), names.end());
    const std::string type = option->get_type_name();
    const std::size_t open = type.find('{');
    const std::size_t close = type.find('}', open);
    if (open == std::string::npos || close == std::string::npos) continue;
    std::string values = type.substr(open + 1, close - open - 1);
    std::replace(values.begin(), values.end(), ',', ' ');
    for (const std::string& name : names) words.values.emplace_back(name, values);
  }
  return words;
}

struct Completion {
  std::string paths;   ///< which words lead on to which command
  std::string values;  ///< of options
  std::string words;   ///< options and commands of each command
};

void complete(const CLI::App& app, const std::string& path, Completion& completion) {
  const Words words = words_of(app);
  std::vector<std::string> commands;
  for (const CLI::App* command : commands_of(app)) {
    commands.push_back(command->get_name());
    complete(*command, path + "/" + command->get_name(), completion);
    completion.paths +=
        fmt::format("      '{0} {1}') path='{0}/{1}' ;;\n", path, command->get_name());
  }
  for (const auto& [option, values] : words.values) {
    completion.values +=
        fmt::format("    '{} {}') COMPREPLY=($(compgen -W '{}' -- \"$current\")); return ;;\n",
                    path, option, values);
  }
  completion.words += fmt::format("    '{}') options='{}'; commands='{}' ;;\n", path,
                                  fmt::join(words.options, " "), fmt::join(commands, " "));
}

void write(const std::string& path, const std::string& text) {
  const core::Status written = core::write_whole_file(path, text);
  if (!written.ok()) throw CLI::FileError(written.error().message);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> man_pages(const CLI::App& app,
                                                           const std::string& program) {
  std::vector<std::pair<std::string, std::string>> pages;
  std::vector<std::string> others;
  std::string list;
  for (const CLI::App* command : commands_of(app)) {
    const std::string title = program + "-" + command->get_name();
    others.push_back(fmt::format(".BR {} (1)", escaped(title)));
    list += fmt::format(".TP\n\\fB{}\\fR\n{}\n", escaped(command->get_name()),
                        escaped(command->get_description()));
    pages.emplace_back(title + ".1",
                       page_of(title, title, first_line(command->get_description()),
                               command_text(*command, program + " " + command->get_name()),
                               fmt::format(".BR {} (1)", escaped(program))));
  }
  std::string body = fmt::format(".SH SYNOPSIS\n{}.SH DESCRIPTION\n{}\n", synopsis(app, program),
                                 escaped(app.get_description()));
  if (!list.empty()) body += ".SH COMMANDS\n" + list;
  body += ".SH OPTIONS\n" + option_section(app);
  if (!app.get_footer().empty())
    body += fmt::format(".SH EXAMPLES\n.nf\n{}\n.fi\n", escaped(app.get_footer()));
  pages.emplace_back(program + ".1", page_of(program, program, first_line(app.get_description()),
                                             body, fmt::format("{}", fmt::join(others, ",\n"))));
  return pages;
}

std::string bash_completion(const CLI::App& app, const std::string& program) {
  Completion completion;
  complete(app, "", completion);
  std::string function = "_" + program;
  std::replace(function.begin(), function.end(), '-', '_');
  return fmt::format(R"(# bash completion for {0}, written by {0} --write-completion
{1}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}}
  local path= options= commands= i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case "$path ${{COMP_WORDS[i]}}" in
{2}    esac
  done
  COMPREPLY=()
  case "$path $before" in
{3}  esac
  case "$path" in
{4}  esac
  if [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$current"))
  elif [[ -n $commands ]]; then
    COMPREPLY=($(compgen -W "$commands" -- "$current"))
  fi
}}
complete -o default -F {1} {0}
)",
                     program, function, completion.paths, completion.values, completion.words);
}

void add_documentation(CLI::App& app, const std::string& program) {
  app.add_option_function<std::string>("--write-man",
                                       [&app, program](const std::string& folder) {
                                         for (const auto& [name, text] : man_pages(app, program)) {
                                           write((std::filesystem::path(folder) / name).string(),
                                                 text);
                                         }
                                         throw CLI::Success();
                                       })
      ->group("")
      ->trigger_on_parse();
  app.add_flag_callback("--list-files",
                        [&app, program] {
                          core::say("{}", list_of_files(app, program));
                          throw CLI::Success();
                        })
      ->group("")
      ->trigger_on_parse();
  app.add_option_function<std::string>("--write-completion",
                                       [&app, program](const std::string& file) {
                                         write(file, bash_completion(app, program));
                                         throw CLI::Success();
                                       })
      ->group("")
      ->trigger_on_parse();
}

}  // namespace ravencal::cli
