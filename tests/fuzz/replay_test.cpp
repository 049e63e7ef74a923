// SPDX-License-Identifier: Apache-2.0
//
// Every kept input of every fuzzer, and mutations of these and of the golden files with a fixed
// seed, so that the harnesses run in every build, not only where libFuzzer is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "fuzz/inputs.hpp"

namespace ravencal::fuzz {
namespace {

namespace fs = std::filesystem;
using Input = std::vector<std::uint8_t>;

struct Parser {
  const char* name;
  void (*try_input)(Bytes);
  /// Mutations in a test run: about two seconds of them.
  std::uint64_t mutations;
  /// Folder with further seeds and how their names end.
  const char* seeds = "";
  const char* ending = "";
};

[[maybe_unused]] void PrintTo(const Parser& parser, std::ostream* out) { *out << parser.name; }

constexpr Parser kParsers[] = {
    {"bag", try_bag, 20},
    {"blob", try_blob, 500'000, "tests/golden", ".blob"},
    {"csv", try_csv, 20'000},
    {"encoder", try_encoder, 50'000},
    {"json", try_json, 20'000, "tests/golden/models", ".json"},
    {"keras", try_keras, 200, "tests/golden/models", ".h5"},
    {"mcap", try_mcap, 20'000, "tests/golden/ros2", ".mcap"},
    {"npz", try_npz, 20'000, "tests/golden/models", ".npz"},
    {"onnx", try_onnx, 5'000, "tests/golden/models", ".onnx"},
    {"plant", try_plant, 2'000, "tools/plants", ".toml"},
    {"profile", try_profile, 20'000, "tools/profiles", ".toml"},
    {"recording", try_recording, 2'000, "tests/golden/record", ".db"},
    {"robot", try_robot, 100, "tools/plants", ".xml"},
    {"telemetry", try_telemetry, 20'000},
};

void add_files(const fs::path& folder, const std::string& ending, std::vector<fs::path>& files) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().string().ends_with(ending)) files.push_back(entry.path());
  }
}

class Replay : public testing::TestWithParam<Parser> {
 protected:
  static std::vector<fs::path> files() {
    const fs::path root = RAVENCAL_SOURCE_DIR;
    std::vector<fs::path> files;
    add_files(root / "tests/fuzz/corpus" / GetParam().name, "", files);
    EXPECT_FALSE(files.empty()) << "no input is kept";
    if (*GetParam().seeds != '\0') add_files(root / GetParam().seeds, GetParam().ending, files);
    std::sort(files.begin(), files.end());
    return files;
  }
  static Input read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
};

INSTANTIATE_TEST_SUITE_P(Parser, Replay, testing::ValuesIn(kParsers),
                         [](const auto& parser) { return std::string(parser.param.name); });

TEST_P(Replay, KeepsItsPromisesOnEveryKeptInput) {
  for (const fs::path& file : files()) {
    SCOPED_TRACE(file.string());
    GetParam().try_input(read(file));
  }
}

/// Sanitized builds are some twenty times slower. RAVENCAL_FUZZ_INPUTS asks for another number.
std::uint64_t mutations(const Parser& parser) {
  const char* const asked = std::getenv("RAVENCAL_FUZZ_INPUTS");
  if (asked != nullptr) return std::strtoull(asked, nullptr, 10);
#ifdef RAVENCAL_SANITIZED
  return parser.mutations / 20;
#else
  return parser.mutations;
#endif
}

TEST_P(Replay, KeepsItsPromisesOnMutations) {
  std::vector<Input> seeds;
  for (const fs::path& file : files()) seeds.push_back(read(file));
  std::mt19937_64 random(20230204);
  for (std::uint64_t i = mutations(GetParam()); i > 0; --i) {
    Input input = seeds[random() % seeds.size()];
    if (input.empty()) continue;
    for (auto changes = 1 + random() % 4; changes > 0; --changes) {
      // Most changes go where the structure is: header, tables and names.
      const std::size_t limit =
          random() % 2 == 0 ? std::min<std::size_t>(512, input.size()) : input.size();
      input[random() % limit] = static_cast<std::uint8_t>(random());
    }
    if (random() % 8 == 0) input.resize(random() % (2 * input.size()));
    GetParam().try_input(input);
  }
}

}  // namespace
}  // namespace ravencal::fuzz
