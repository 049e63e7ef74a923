// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/exit_code.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "prove/leak.hpp"
#include "prove/one.hpp"
#include "prove/proof.hpp"
#include "prove/reliability.hpp"
#include "prove/score_proof.hpp"
#include "prove/tally.hpp"
#include "prove/worlds.hpp"

namespace ravencal::commands {
namespace {

struct ProveArguments {
  prove::ProofOptions proof;
  std::string out, tool, data, house;
  std::string until = "score", world = "own", part;
  prove::LeakOptions leak;
  std::optional<std::uint64_t> one;
  bool no_leak_test = false;
  bool check = false;
};

/// One line of progress per stage; a stage's jobs call from several threads.
prove::Look progress_of(std::string_view stage) {
  auto progress = std::make_shared<cli::Progress>(stage);
  auto mutex = std::make_shared<std::mutex>();
  return [progress, mutex](double done, std::string_view what) {
    const std::lock_guard<std::mutex> lock(*mutex);
    if (done >= 0.0) progress->update(done, what);
    return !cli::interrupted();
  };
}

/// "3/8" as [3, 8]. Parts do not seal: processes that begin together would make the same cases.
core::Status take_part(const std::string& text, prove::ProofOptions& options) {
  if (text.empty()) return {};
  const char* const end = text.data() + text.size();
  const auto [slash, no_part] = std::from_chars(text.data(), end, options.part);
  const bool two = no_part == std::errc() && slash != end && *slash == '/';
  const auto [last, no_parts] = std::from_chars(two ? slash + 1 : end, end, options.parts);
  const bool read = two && no_parts == std::errc() && last == end;
  if (!read || options.part < 1 || options.part > options.parts)
    return core::usage_error(fmt::format("--part {}: is not K/N with K from 1 to N", text));
  if (!std::filesystem::exists(options.out / "seal.json"))
    return core::usage_error(
        fmt::format("{}: has no seal.json; seal the cases first, by --until seal without --part",
                    options.out.string()));
  return {};
}

/// Opens the only case, and says what it hid and what was found.
core::Status tell_one(const prove::ProofOptions& options, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto cases, prove::open_cases(options.out));
  RAVENCAL_ASSIGN_OR_RETURN(const nlohmann::ordered_json one, prove::one_json(cases.front()));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(options.out / "one.json", one.dump(1) + "\n"));
  core::say("{}report: {}\n", prove::one_text(one),
            (options.out / "diagnosis/report.html").string());
  if (one["outcome"] != "found") exit_code = cli::kFinding;
  return {};
}

core::Status score(const ProveArguments& arguments, prove::ProofOptions& options, int& exit_code) {
  if (const int missing = prove::missing_verdicts(options); missing > 0) {
    core::say("part {} of {} is done; {} cases of other parts have no verdict yet\n", options.part,
              options.parts, missing);
    return {};
  }
  options.look = progress_of("prove: leak test");
  RAVENCAL_ASSIGN_OR_RETURN(
      const nlohmann::ordered_json proof,
      prove::score_proof(options,
                         arguments.no_leak_test ? std::nullopt : std::optional(arguments.leak)));
  core::say("{}{}{}", prove::targets_text(proof), prove::worlds_text(proof),
            prove::reliability_text(proof["reliability"]));
  if (proof.contains("leak_test")) {
    const auto& leak = proof["leak_test"];
    core::say(
        "leak test: {:.1f} % of {} pairs told apart (95 % between {:.1f} and {:.1f}): {}\n",
        100.0 * leak["accuracy"].get<double>(), leak["pairs"].get<int>(),
        100.0 * leak["ci95"][0].get<double>(), 100.0 * leak["ci95"][1].get<double>(),
        leak["at_chance"].get<bool>() ? "chance" : "the form of the cases reveals their content");
  }
  const auto& cost = proof["cpu_minutes_per_hundred_on_two_cores"];
  core::say(
      "{} cases, {} without a report; processor time per hundred cases on two cores: {:.1f} min to "
      "make, {:.1f} min to diagnose\n{}proof: {}/proof.html\n",
      proof["cases"].get<int>(), proof["without_report"].get<int>(), cost["generate"].get<double>(),
      cost["diagnose"].get<double>(),
      options.data.empty() ? "real recordings: not tried; give their folder by --data or "
                             "RAVENCAL_DATA_DIR\n"
                           : "",
      arguments.out);
  for (const auto& target : proof["targets"]) {
    if (arguments.check && target["verdict"] == "not met") exit_code = 1;
  }
  return {};
}

core::Status run(const ProveArguments& arguments, int& exit_code) {
  prove::ProofOptions options = arguments.proof;
  options.out = arguments.out;
  options.data = arguments.data;
  options.house = arguments.house;
  options.world = prove::world_choice(arguments.world).value_or(prove::WorldChoice::kOwn);
  if (arguments.one) {
    options.one = options.keep_recordings = true;
    options.seed = *arguments.one;
    options.cases = 1;
    options.data.clear();
  }
  std::error_code error;
  options.tool =
      std::filesystem::canonical(arguments.tool.empty() ? "/proc/self/exe" : arguments.tool, error);
  if (error)
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: {}", arguments.tool, error.message())};
  RAVENCAL_RETURN_IF_ERROR(take_part(arguments.part, options));
  cli::catch_interrupts_of_work();
  options.look = progress_of("prove: making and sealing cases");
  RAVENCAL_RETURN_IF_ERROR(prove::seal_cases(options));
  if (arguments.until == "seal") return {};
  options.look = progress_of("prove: diagnosing");
  RAVENCAL_RETURN_IF_ERROR(prove::run_cases(options));
  if (arguments.until == "run") return {};
  return options.one ? tell_one(options, exit_code) : score(arguments, options, exit_code);
}

/// What makes the cases.
void add_case_options(CLI::App& command, ProveArguments& arguments) {
  prove::ProofOptions& proof = arguments.proof;
  CLI::Option* cases =
      command.add_option("--cases", proof.cases, "Synthetic cases; the mix repeats every 20")
          ->check(CLI::Range(1, 9999))
          ->capture_default_str();
  CLI::Option* seed =
      command.add_option("--seed", proof.seed, "Same seed, same cases")->capture_default_str();
  command
      .add_option("--one", arguments.one,
                  "One case of this seed in place of a proof: says what was hidden and what found")
      ->excludes(cases)
      ->excludes(seed);
  command.add_option("--duration-s", proof.duration_s, "Length of a recording")
      ->check(CLI::Range(20.0, 7200.0))
      ->capture_default_str();
  command
      .add_option("--held-out-s", proof.held_out_s,
                  "Length of the held-out recording, which gives the figures")
      ->check(CLI::Range(10.0, 7200.0))
      ->capture_default_str();
  command
      .add_option("--data", arguments.data,
                  "Folder of real recordings: adds ablated and injected cases")
      ->envname("RAVENCAL_DATA_DIR");
  command
      .add_option("--house", arguments.house,
                  "Folder with plants/ and profiles/ of the real recordings")
      ->default_val("tools");
  command
      .add_option("--world", arguments.world,
                  "Laws that make the cases (tools/prove/WORLDS.md); both: in turn")
      ->check(CLI::IsMember({"own", "other", "both"}))
      ->capture_default_str();
}

cli::Paths folder_of_proof(const CLI::App& command) {
  const std::filesystem::path folder = cli::path_of(command, "--out");
  if (!cli::is_record_of_run(folder / "prove.json", {"schema", "cases"})) return {};
  return {folder};
}

}  // namespace

void add_prove(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ProveArguments>();
  prove::ProofOptions& proof = arguments->proof;
  CLI::App* command = app.add_subcommand(
      "prove", "Test diagnose blind: cases sealed before the run, scored after it");
  command->add_option("--out", arguments->out, "Folder of the proof; the same command continues it")
      ->required();
  add_case_options(*command, *arguments);
  command->add_option("--jobs", proof.jobs, "Cases at the same time")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_option("--limit-s", proof.limit_s, "Longest time of one diagnosis")
      ->check(CLI::Range(1.0, 1e7))
      ->capture_default_str();
  command->add_option("--tool", arguments->tool, "Program to test instead of this one");
  command->add_option("--until", arguments->until, "Stop after this stage")
      ->check(CLI::IsMember({"seal", "run", "score"}))
      ->capture_default_str();
  command->add_option(
      "--part", arguments->part,
      "K/N: diagnose every Nth case, from case K - 1 on, of a sealed proof; the last "
      "part scores. Processes may share the folder");
  command->add_flag("--keep-recordings", proof.keep_recordings,
                    "Keep the recordings after the diagnosis");
  command
      ->add_option("--leak-pairs", arguments->leak.pairs,
                   "Recordings of either kind in the leak test")
      ->check(CLI::Range(10, 9999))
      ->capture_default_str();
  command->add_flag("--no-leak-test", arguments->no_leak_test,
                    "Skip the leak test unless it was done before");
  command->add_flag("--check", arguments->check, "Exit with 1 if a target is not met");
  command->footer(
      "seal.json commits to the concealed effects before the first run, verdicts.json to the\n"
      "verdicts before the first manifest is opened. Scoring checks every hash.\n"
      "--one hides one effect of the vocabulary, each as likely, in the largest class of sizes\n"
      "(10 floors and more), and draws again where the recordings show less. Another effect may\n"
      "imitate it (imitated_by in one.json). Recordings (given/0000), report (diagnosis/) and\n"
      "one.json stay. Exit code 1 if the effect was not found, or not alone.\n"
      "On a cluster: --until seal, then tools/prove/prove.sbatch.\n"
      "Example: ravencal prove --out proof --cases 300 --seed 7\n"
      "Example: ravencal prove --one 7 --out one");
  const FileOptions files = {
      .read = {"--data", "--house", "--tool"}, .folders = {"--out"}, .own = folder_of_proof};
  on_call(*command, exit_code, files,
          [arguments, &exit_code] { return run(*arguments, exit_code); });
}

}  // namespace ravencal::commands
