// SPDX-License-Identifier: Apache-2.0
//
// How a CSV file is written, by its first lines, and its text as the kernels read it: commas,
// decimal points, no quotes around numbers. Private to record/.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::record {

/// Lines that decide on the delimiter: one may be a bad row, most are not. No source: a choice.
inline constexpr std::size_t kDialectLines = 20;

struct CsvDialect {
  char delimiter = ',';  ///< ' ': any run of blanks
  bool is_plain = true;  ///< the kernels read it as it is
};

/// Decides by whole lines from the file's beginning. `place` is the file's name. Errors (kData): no
/// delimiter makes as many columns of the rows as of the first line; two do.
core::Result<CsvDialect> find_dialect(std::string_view beginning, const std::string& place);

/// The same lines and columns with commas and decimal points. Errors (kData): decimal commas beside
/// decimal points; commas that may be of thousands.
core::Result<std::string> in_plain_form(std::string_view text, char delimiter,
                                        const std::string& place);

/// Numpy.savetxt begins a header with "# ".
std::string_view without_comment_sign(std::string_view first_line);

}  // namespace ravencal::record
