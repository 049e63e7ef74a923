// SPDX-License-Identifier: Apache-2.0
#include "csv_input.hpp"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "record/csv_export.hpp"
#include "record/load.hpp"

namespace ravencal::fuzz {
namespace {

constexpr const char* kProfile = R"([source]
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

void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

void check(const core::Result<record::Recording>& loaded, const std::filesystem::path& path) {
  if (!loaded.ok()) {
    require(loaded.error().message.starts_with(path.string()), "an error names its file");
    return;
  }
  const auto rows = static_cast<std::size_t>(loaded->rows());
  require(rows > 0 && loaded->t_ns.size() == rows, "as many stamps as rows");
  require(static_cast<std::size_t>(loaded->samples.cols()) == loaded->channels.size(),
          "as many columns as channels");
  for (std::size_t i = 1; i < rows; ++i) {
    require(loaded->t_ns[i - 1] <= loaded->t_ns[i], "time never decreases");
  }
}

}  // namespace

void try_csv(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder) {
  if (bytes.empty()) return;
  const std::uint8_t how = bytes[0];
  const std::filesystem::path path = folder / "fuzz.csv";
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()) + 1,
             static_cast<std::streamsize>(bytes.size() - 1));
  record::LoadOptions options;
  options.skip_bad = (how & 1U) != 0;
  options.threads = 1;
  options.profile = "generic";
  if ((how & 2U) != 0) {
    options.profile = (folder / "fuzz.toml").string();
    std::ofstream(options.profile) << kProfile;
  }
  const auto loaded = record::load_recording(path, options);
  check(loaded, path);
  if (!loaded.ok() || options.profile != "generic") return;
  const auto out = folder / "fuzz_out.csv";
  const auto exported = record::export_csv(*loaded, *record::load_profile("generic"), out);
  require(exported.ok(), "what was read can be exported");
}

}  // namespace ravencal::fuzz
