// SPDX-License-Identifier: Apache-2.0
#include "prove/proof.hpp"

#include <ctime>

#include "prove/baselines.hpp"
#include "prove/child.hpp"
#include "prove/generator/case.hpp"
#include "prove/parallel.hpp"
#include "prove/real_cases.hpp"
#include "prove/seal.hpp"
#include "prove/workspace.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::prove {
namespace {

namespace fs = std::filesystem;

core::Error bad(const fs::path& path, const std::string& why) {
  return {core::ErrorCode::kData, fmt::format("{}: {}", path.string(), why)};
}

Json settings_of(const ProofOptions& options) {
  Json settings = {{"schema", 1},
                   {"seed", options.seed},
                   {"cases", options.cases},
                   {"duration_s", options.duration_s},
                   {"held_out_s", options.held_out_s},
                   {"real_recordings", !options.data.empty()}};
  // A proof without the key is one of the own world.
  if (options.world != WorldChoice::kOwn) settings["world"] = word_of(options.world);
  if (options.one) settings["one"] = true;
  return settings;
}

CaseOptions case_options_of(const ProofOptions& options) {
  return {options.seed, options.duration_s, options.held_out_s, options.world};
}

core::Status begin(const ProofOptions& options) {
  std::error_code error;
  for (const char* folder : {"given", "sealed", "verdicts"})
    fs::create_directories(options.out / folder, error);
  if (options.one) fs::create_directories(options.out / "diagnosis", error);
  if (error)
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: {}", options.out.string(), error.message())};
  const fs::path path = options.out / "prove.json";
  if (!fs::exists(path)) return core::write_whole_file(path, settings_of(options).dump(1) + "\n");
  RAVENCAL_ASSIGN_OR_RETURN(const Json before, read_json(path));
  if (before == settings_of(options)) return {};
  return core::Error{core::ErrorCode::kUsage,
                     fmt::format("{}: was begun with other options ({}); go on with those or use "
                                 "another --out",
                                 options.out.string(), before.dump())};
}

/// Writes the files that the tool gets, and a commitment to the manifest.
core::Status seal_one(const Workspace& space, int number, CaseFiles files, double generate_s) {
  const fs::path given = space.given(number);
  std::error_code error;
  fs::create_directories(given, error);
  Json manifest = Json::parse(files.manifest);
  manifest["case"] = number;
  manifest["generate_s"] = generate_s;
  RAVENCAL_RETURN_IF_ERROR(record::write_recording(files.recording, given / "recording.db", true));
  if (files.held_out.rows() > 0)
    RAVENCAL_RETURN_IF_ERROR(record::write_recording(files.held_out, given / "held_out.db", true));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(given / "plant.toml", files.plant));
  for (const char* name : {"recording.db", "held_out.db", "plant.toml"}) {
    if (!fs::exists(given / name)) continue;
    RAVENCAL_ASSIGN_OR_RETURN(manifest["files"][name], sha256_of_file(given / name));
  }
  const Json sealed = {{"nonce", fresh_nonce()}, {"manifest", manifest.dump(1)}};
  return core::write_whole_file(space.sealed(number), sealed.dump(1) + "\n");
}

core::Result<std::string> commitment_of(const Workspace& space, int number) {
  RAVENCAL_ASSIGN_OR_RETURN(const Json sealed, read_json(space.sealed(number)));
  if (!sealed.contains("nonce") || !sealed.contains("manifest"))
    return bad(space.sealed(number), "has no nonce or no manifest");
  return commitment(sealed["nonce"].get<std::string>(), sealed["manifest"].get<std::string>());
}

/// How many cases the folder has: the synthetic ones, then those from real recordings.
int all_cases(const ProofOptions& options) {
  return options.cases + (options.data.empty() ? 0 : static_cast<int>(real_cases().size()));
}

/// Draws until the recordings show the effect in its class: a motion, a channel that is missing or
/// a robot that cannot bear it may make it smaller.
core::Result<CaseFiles> files_of_one(const ProofOptions& options,
                                     const std::function<bool()>& look) {
  constexpr int kDraws = 20;
  for (int draw = 0; draw < kDraws; ++draw) {
    RAVENCAL_ASSIGN_OR_RETURN(CaseFiles files,
                              make_case(draw_gross_case(draw, case_options_of(options)), look));
    const Json manifest = Json::parse(files.manifest);
    const Json& subject = manifest["subjects"][0];
    if (manifest["excited"].get<bool>() &&
        subject["size_over_floor"].get<double>() >= kLargestClass)
      return files;
  }
  return core::Error{core::ErrorCode::kData,
                     fmt::format("seed {}: none of {} draws shows its effect at {} floors; use "
                                 "another seed or longer recordings",
                                 options.seed, kDraws, kLargestClass)};
}

core::Result<CaseFiles> files_of(const ProofOptions& options, int number) {
  const auto look = [&options] { return !options.look || options.look(-1.0, ""); };
  if (options.one) return files_of_one(options, look);
  if (number >= options.cases) {
    const RealCase& real = real_cases()[static_cast<std::size_t>(number - options.cases)];
    return make_real_case(real, options.data, options.house, options.seed);
  }
  return make_case(draw_case(number, case_options_of(options)), look);
}

core::Status write_seal(const ProofOptions& options, const Workspace& space) {
  Json commitments = Json::array();
  for (int i = 0; i < all_cases(options); ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, commitment_of(space, i));
    commitments.push_back(hash);
  }
  const fs::path path = options.out / "seal.json";
  if (fs::exists(path)) {
    RAVENCAL_ASSIGN_OR_RETURN(const Json before, read_json(path));
    if (before.value("commitments", Json()) == commitments) return {};
    return bad(path, "the cases are not those that were sealed; begin again in another folder");
  }
  RAVENCAL_ASSIGN_OR_RETURN(const std::string tool, sha256_of_file(options.tool));
  const Json seal = {{"schema", 1},
                     {"merkle_root", merkle_root(commitments.get<std::vector<std::string>>())},
                     {"tool_sha256", tool},
                     {"commitments", commitments}};
  return core::write_whole_file(path, seal.dump(1) + "\n");
}

/// Processor time of this thread: the cost of a case without the machine's other work.
double thread_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

core::Status seal_cases(const ProofOptions& options) {
  if (!options.data.empty())
    RAVENCAL_RETURN_IF_ERROR(have_real_recordings(options.data, options.house));
  RAVENCAL_RETURN_IF_ERROR(begin(options));
  const Workspace space{options.out};
  const auto count = static_cast<std::size_t>(all_cases(options));
  const core::Status finished =
      in_parallel(options, count, "case {} of {}", [&](std::size_t i) -> core::Status {
        const int number = static_cast<int>(i);
        if (!fs::exists(space.sealed(number))) {
          const double start_s = thread_s();
          RAVENCAL_ASSIGN_OR_RETURN(CaseFiles files, files_of(options, number));
          RAVENCAL_RETURN_IF_ERROR(seal_one(space, number, std::move(files), thread_s() - start_s));
        }
        return {};
      });
  RAVENCAL_RETURN_IF_ERROR(finished);
  return write_seal(options, space);
}

namespace {

/// Of the diagnosis of the only case.
constexpr const char* kKept[] = {"diagnosis/report.json", "diagnosis/report.html",
                                 "diagnosis/plant_improved.toml"};

ChildOptions child_of(const ProofOptions& options, const fs::path& given) {
  ChildOptions child;
  child.command = {options.tool.string(),
                   "diagnose",
                   "recording.db",
                   "--plant",
                   "plant.toml",
                   "--out",
                   "diagnosis",
                   "--json",
                   "verdict.json",
                   "--threads",
                   options.one ? "0" : "1",
                   "--placebo",
                   "0"};
  child.given = {{given / "recording.db", "recording.db"}, {given / "plant.toml", "plant.toml"}};
  if (fs::exists(given / "held_out.db")) {
    child.given.emplace_back(given / "held_out.db", "held_out.db");
    child.command.insert(child.command.end(), {"--held-out", "held_out.db"});
  }
  child.wanted = {"verdict.json"};
  if (options.one) child.wanted.insert(child.wanted.end(), std::begin(kKept), std::end(kKept));
  child.limit_s = options.limit_s;
  child.look = [&options] { return !options.look || options.look(-1.0, ""); };
  return child;
}

core::Status run_case(const ProofOptions& options, const Workspace& space, int number) {
  const fs::path given = space.given(number);
  const ChildOptions child = child_of(options, given);
  Json inputs;
  for (const auto& [path, name] : child.given) {
    RAVENCAL_ASSIGN_OR_RETURN(inputs[name], sha256_of_file(path));
  }
  RAVENCAL_ASSIGN_OR_RETURN(const ChildResult result, run_child(child));
  Json verdict = {
      {"case", number},          {"exit_code", result.exit_code}, {"timed_out", result.timed_out},
      {"wall_s", result.wall_s}, {"cpu_s", result.cpu_s},         {"inputs", inputs},
      {"report", nullptr}};
  for (const auto& [name, content] : result.files) {
    if (name != "verdict.json") {
      RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(options.out / name, content));
      continue;
    }
    const Json report = Json::parse(content, nullptr, false);
    if (!report.is_discarded()) verdict["report"] = report;
  }
  if (verdict["report"].is_null()) verdict["log"] = result.log;
  if (number < options.cases && !options.one) {
    RAVENCAL_ASSIGN_OR_RETURN(const record::Recording recording,
                              record::read_recording(given / "recording.db"));
    RAVENCAL_ASSIGN_OR_RETURN(const record::Recording held_out,
                              record::read_recording(given / "held_out.db"));
    verdict["baselines"] =
        run_baselines(recording, held_out, draw_case(number, case_options_of(options)).nominal);
  }
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(
      space.verdict(number), verdict.dump(1, ' ', false, Json::error_handler_t::replace) + "\n"));
  std::error_code ignored;
  if (!options.keep_recordings) {
    for (const char* name : {"recording.db", "held_out.db"}) fs::remove(given / name, ignored);
  }
  return {};
}

}  // namespace

core::Status run_cases(const ProofOptions& options) {
  const Workspace space{options.out};
  RAVENCAL_ASSIGN_OR_RETURN(const Json seal, read_json(options.out / "seal.json"));
  RAVENCAL_ASSIGN_OR_RETURN(const std::string tool, sha256_of_file(options.tool));
  const auto count = static_cast<std::size_t>(all_cases(options));
  std::vector<int> open;
  for (int i = 0; i < static_cast<int>(count); ++i)
    if (i % options.parts == options.part - 1 && !fs::exists(space.verdict(i))) open.push_back(i);
  if (!open.empty() && seal.value("tool_sha256", "") != tool) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: is another program than the one that was sealed; a changed "
                                   "tool needs a fresh seal in another --out",
                                   options.tool.string())};
  }
  RAVENCAL_RETURN_IF_ERROR(in_parallel(options, open.size(), "{} of {} cases", [&](std::size_t i) {
    return run_case(options, space, open[i]);
  }));
  const fs::path path = options.out / "verdicts.json";
  if (fs::exists(path) || missing_verdicts(options) > 0) return {};
  Json hashes = Json::array();
  for (int i = 0; i < static_cast<int>(count); ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, sha256_of_file(space.verdict(i)));
    hashes.push_back(hash);
  }
  const Json sealed = {{"schema", 1},
                       {"merkle_root", merkle_root(hashes.get<std::vector<std::string>>())},
                       {"hashes", hashes}};
  return core::write_whole_file(path, sealed.dump(1) + "\n");
}

int missing_verdicts(const ProofOptions& options) {
  const Workspace space{options.out};
  int missing = 0;
  for (int i = 0; i < all_cases(options); ++i) missing += fs::exists(space.verdict(i)) ? 0 : 1;
  return missing;
}

core::Result<std::vector<OpenedCase>> open_cases(const fs::path& out) {
  const Workspace space{out};
  RAVENCAL_ASSIGN_OR_RETURN(const Json seal, read_json(out / "seal.json"));
  RAVENCAL_ASSIGN_OR_RETURN(const Json said, read_json(out / "verdicts.json"));
  const auto commitments = seal.value("commitments", std::vector<std::string>());
  const auto hashes = said.value("hashes", std::vector<std::string>());
  if (merkle_root(commitments) != seal.value("merkle_root", ""))
    return bad(out / "seal.json", "the Merkle root is not that of its commitments");
  if (merkle_root(hashes) != said.value("merkle_root", ""))
    return bad(out / "verdicts.json", "the Merkle root is not that of its hashes");
  if (hashes.size() != commitments.size())
    return bad(out / "verdicts.json", "has another number of cases than the seal");
  std::vector<OpenedCase> cases;
  for (int i = 0; i < static_cast<int>(hashes.size()); ++i) {
    const auto n = static_cast<std::size_t>(i);
    OpenedCase opened;
    opened.number = i;
    RAVENCAL_ASSIGN_OR_RETURN(opened.verdict, core::read_whole_file(space.verdict(i)));
    if (sha256(opened.verdict) != hashes[n])
      return bad(space.verdict(i), "was changed after it was sealed");
    RAVENCAL_ASSIGN_OR_RETURN(const std::string hash, commitment_of(space, i));
    if (hash != commitments[n])
      return bad(space.sealed(i), "is not what was committed to before the run");
    RAVENCAL_ASSIGN_OR_RETURN(const Json sealed, read_json(space.sealed(i)));
    opened.manifest = sealed["manifest"].get<std::string>();
    const Json manifest = Json::parse(opened.manifest, nullptr, false);
    const Json verdict = Json::parse(opened.verdict, nullptr, false);
    if (manifest.is_discarded() || verdict.is_discarded() || verdict.value("case", -1) != i ||
        manifest.value("case", -1) != i ||
        nlohmann::json(verdict.value("inputs", Json())) !=
            nlohmann::json(manifest.value("files", Json())))
      return bad(space.verdict(i), "was not made from the files of this case");
    cases.push_back(std::move(opened));
  }
  return cases;
}

}  // namespace ravencal::prove
