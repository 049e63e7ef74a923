// SPDX-License-Identifier: Apache-2.0
//
// The blind proof as a folder, which an interrupted run continues: seal the cases, run the tool on
// each, seal its verdicts, open, check every hash, score.
//
//   prove.json            seed, number of cases, durations, world: what makes the cases
//   given/N/              recording.db, held_out.db, plant.toml: all that the tool gets
//   sealed/N.json         nonce and manifest: what is hidden
//   seal.json             commitments, Merkle root, hash of the tool: written before the first run
//   verdicts/N.json       the tool's report and the baselines'
//   verdicts.json         their hashes and Merkle root: written before the first manifest is read
//   leak.json             whether recordings give away by their form what they hide
//   proof.json, proof.html
//
// A proof of one case (`prove --one`) has diagnosis/ and one.json in place of the last two lines.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "prove/generator/world.hpp"

namespace ravencal::prove {

/// Called with the share of a stage that is done ([0, 1]); false stops (kUsage), and the folder
/// stays valid.
using Look = std::function<bool(double done, std::string_view what)>;

/// Times the floor: where the largest class of sizes begins.
inline constexpr double kLargestClass = 10.0;

struct ProofOptions {
  std::filesystem::path out;
  int cases = 300;
  std::uint64_t seed = 1;
  double duration_s = 240.0, held_out_s = 90.0;
  WorldChoice world = WorldChoice::kOwn;
  unsigned jobs = 2;
  /// Diagnoses only cases whose number is part - 1 modulo parts; part in [1, parts].
  int part = 1, parts = 1;
  std::filesystem::path tool;   ///< program with the command `diagnose`
  double limit_s = 600.0;       ///< for one diagnosis
  std::filesystem::path data;   ///< real recordings; empty: the synthetic track only
  std::filesystem::path house;  ///< folder with plants/ and profiles/ of the real recordings
  bool keep_recordings = false;
  /// The only case (`cases` is 1, `data` empty) has one effect of the largest class of sizes; the
  /// files of its diagnosis stay in diagnosis/.
  bool one = false;
  Look look;
};

/// What one case hides, as committed.
struct SealedCase {
  std::string nonce;
  std::string manifest;  ///< JSON text, byte for byte as hashed
};

/// Makes the cases that are missing, then seal.json. Errors: kUsage if the folder was begun with
/// other options, kData if a case no longer fits its seal.
core::Status seal_cases(const ProofOptions& options);
/// Runs the tool on cases of this part without a verdict. Whoever leaves no case without one seals
/// the verdicts, so that processes may share the folder. Errors: kUsage if the tool is not the one
/// that was sealed.
core::Status run_cases(const ProofOptions& options);
/// Cases that still have no verdict, of all parts.
int missing_verdicts(const ProofOptions& options);

/// Everything after both seals, hashes checked. Errors: kData names the first case or verdict that
/// differs from its seal.
struct OpenedCase {
  int number = 0;
  std::string manifest, verdict;  ///< JSON texts
};
core::Result<std::vector<OpenedCase>> open_cases(const std::filesystem::path& out);

}  // namespace ravencal::prove
