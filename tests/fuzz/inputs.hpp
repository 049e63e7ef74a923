// SPDX-License-Identifier: Apache-2.0
//
// What the harnesses of libFuzzer (harness.cpp) and the test that replays their findings
// (replay_test.cpp) share: for every parser of bytes from outside a function that gives it one
// input and demands its contract. The contract of all: a result that keeps its invariants or an
// error in words that names the file, within bounded time and memory. One thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// Each aborts where a promise is broken. X reads tests/fuzz/corpus/X; a first byte or the file's
/// own mark chooses among several ways to read, as the source says.
void try_bag(Bytes bytes);
void try_blob(Bytes bytes);
void try_csv(Bytes bytes);
void try_encoder(Bytes bytes);
void try_json(Bytes bytes);
void try_keras(Bytes bytes);
void try_mcap(Bytes bytes);
void try_npz(Bytes bytes);
void try_onnx(Bytes bytes);
void try_plant(Bytes bytes);
void try_profile(Bytes bytes);
void try_recording(Bytes bytes);
void try_robot(Bytes bytes);
void try_telemetry(Bytes bytes);

/// Aborts, and says what was promised, unless it was kept.
void promise(bool kept, std::string_view what);

/// The error, if there is one, says of which file it is and what is wrong with it.
void promise_words(const core::Error& error, std::string_view file);
template <typename T>
bool read_or_words(const core::Result<T>& result, std::string_view file) {
  if (!result.ok()) promise_words(result.error(), file);
  return result.ok();
}

/// A path in a folder of this process, in memory where the system has one there.
std::filesystem::path scratch_path(std::string_view name);

/// Writes the bytes there.
std::filesystem::path scratch_file(std::string_view name, Bytes bytes);

std::string_view text_of(Bytes bytes);

}  // namespace ravencal::fuzz
