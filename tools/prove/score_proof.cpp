// SPDX-License-Identifier: Apache-2.0
#include "prove/score_proof.hpp"

#include "prove/tally.hpp"
#include "prove/workspace.hpp"
#include "prove/worlds.hpp"
#include "report/document.hpp"

extern "C" {
// Names of the assembler (ravencal_embed_script). NOLINTNEXTLINE(readability-identifier-naming)
extern const char ravencal_prove_page[], ravencal_prove_page_end[];
}

namespace ravencal::prove {

std::string proof_html(const Json& proof) {
  return report::drawn_html("Blind proof of ravencal diagnose",
                            proof.dump(-1, ' ', false, Json::error_handler_t::replace),
                            "proof.json", {ravencal_prove_page, ravencal_prove_page_end});
}

core::Result<Json> score_proof(const ProofOptions& options,
                               const std::optional<LeakOptions>& leak_options) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<OpenedCase> cases, open_cases(options.out));
  std::vector<CaseScore> scores;
  for (const OpenedCase& opened : cases) {
    RAVENCAL_ASSIGN_OR_RETURN(CaseScore score, score_case(opened));
    scores.push_back(std::move(score));
  }
  Json proof = tally(scores);
  if (const Json worlds = worlds_json(scores); worlds.size() > 1) proof["worlds"] = worlds;
  RAVENCAL_ASSIGN_OR_RETURN(const Json seal, read_json(options.out / "seal.json"));
  proof["seal"] = {{"merkle_root", seal.value("merkle_root", "")},
                   {"tool_sha256", seal.value("tool_sha256", "")},
                   {"every_hash_checked", true},
                   {"seed", options.seed}};
  const auto path = options.out / "leak.json";
  if (leak_options && !std::filesystem::exists(path)) {
    RAVENCAL_ASSIGN_OR_RETURN(const Json leak, leak_test(options, *leak_options));
    RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(path, leak.dump(1) + "\n"));
  }
  if (std::filesystem::exists(path)) {
    RAVENCAL_ASSIGN_OR_RETURN(proof["leak_test"], read_json(path));
  }
  RAVENCAL_RETURN_IF_ERROR(
      core::write_whole_file(options.out / "proof.json", proof.dump(1) + "\n"));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(options.out / "proof.html", proof_html(proof)));
  return proof;
}

}  // namespace ravencal::prove
