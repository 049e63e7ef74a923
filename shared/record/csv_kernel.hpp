// SPDX-License-Identifier: Apache-2.0
//
// The inner loop of CSV reading: split a line at its commas, turn fields into numbers. One form for
// every machine and one for x86 with AVX-512, chosen at run time; both round correctly, and a test
// holds them against each other. Private to record/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ravencal::record {

/// Bytes behind the last line end that the kernels may read.
inline constexpr std::size_t kCsvPadding = 64;
/// Entries behind the last field that split() may write.
inline constexpr std::size_t kCsvFieldSlack = 64;

/// A field to be read as a number, and where it goes in the row.
struct NumberField {
  std::uint32_t field = 0;
  std::uint32_t target = 0;
};

struct CsvKernel {
  /// Finds where the fields of a line end: offsets from `line` of its commas and of its '\n', which
  /// must exist. Returns how many; stops early, with any count above `limit`, when there are more.
  /// `ends` has room for limit + kCsvFieldSlack.
  std::size_t (*split)(const char* line, std::size_t limit, std::uint32_t* ends);

  /// Parses fields into row[target]. False if any is not a plain finite number.
  bool (*parse)(const char* line, const std::uint32_t* ends, std::span<const NumberField> fields,
                double* row);
};

const CsvKernel& portable_csv_kernel();
/// nullptr where the machine cannot run it.
const CsvKernel* avx512_csv_kernel();
/// The fastest one of this machine.
const CsvKernel& csv_kernel();

}  // namespace ravencal::record
