// SPDX-License-Identifier: Apache-2.0
//
// The first byte chooses (bit 0) whether bad rows are skipped and (bit 1) the profile. One in eight
// recordings is also exported, which takes longer.
#include "fuzz/inputs.hpp"
#include "record/csv_export.hpp"
#include "record/csv_load.hpp"
#include "record/profile_toml.hpp"

namespace ravencal::fuzz {
namespace {

constexpr std::string_view kProfile = R"([source]
time = "t"
time_missing = "row_number"
episode = "run"
reference = "first"
[[filter]]
column = "ok"
keep = [1, "yes"]
[[channel]]
name = "estimate"
column = "e"
unit = "deg"
role = "joint_estimate"
joint = "x"
[[channel]]
name = "truth"
column = "w"
unit = "deg"
role = "joint_truth"
joint = "x"
may_be_missing = true
valid_when = {column = "run", equals = "a"}
)";

void check(const core::Result<record::Recording>& loaded, const std::filesystem::path& path) {
  if (!read_or_words(loaded, path.string())) return;
  const auto rows = static_cast<std::size_t>(loaded->rows());
  promise(rows > 0 && loaded->t_ns.size() == rows, "as many stamps as rows");
  promise(static_cast<std::size_t>(loaded->samples.cols()) == loaded->channels.size(),
          "as many columns as channels");
  for (std::size_t i = 1; i < rows; ++i) {
    promise(loaded->t_ns[i - 1] <= loaded->t_ns[i], "time never decreases");
  }
}

}  // namespace

void try_csv(Bytes bytes) {
  static const record::Profile generic = *record::load_profile("generic");
  static const record::Profile own = *record::parse_profile(kProfile, "csv.toml");
  if (bytes.empty()) return;
  const std::uint8_t how = bytes[0];
  const std::filesystem::path path = scratch_file("fuzz.csv", bytes.subspan(1));
  record::LoadOptions options;
  options.skip_bad = (how & 1U) != 0;
  options.threads = 1;
  const bool is_generic = (how & 2U) == 0;
  const auto loaded = record::load_csv(path, is_generic ? generic : own, options);
  check(loaded, path);
  if (!loaded.ok() || !is_generic || bytes.size() % 8 != 0) return;
  const auto exported = record::export_csv(*loaded, generic, scratch_path("fuzz_out.csv"));
  promise(exported.ok(), "what was read can be exported");
}

}  // namespace ravencal::fuzz
