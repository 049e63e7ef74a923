// SPDX-License-Identifier: Apache-2.0
//
// Values at the stamps of other messages. Private to exchange/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace ravencal::exchange {

/// A value that no message says.
inline constexpr double kLost = std::numeric_limits<double>::quiet_NaN();

/// `values` at `at_ns`, linear between their stamps; NaN before, behind and in gaps of more than
/// five median periods or 50 ms, whichever is longer. Both times rise.
std::vector<double> interpolated(std::span<const std::int64_t> t_ns, std::span<const double> values,
                                 std::span<const std::int64_t> at_ns);

/// For each row the message of the same sweep over the joints: that at the usual delay behind the
/// row's stamp (before it, where the file has these messages before the row's, `is_first`), up to
/// half a period off. None where a row has none. No result: the messages come at another rate than
/// the rows, or at no steady delay. Both times rise.
std::optional<std::vector<std::optional<std::size_t>>> sweep_of(
    std::span<const std::int64_t> row_t_ns, std::span<const std::int64_t> t_ns, bool is_first);

}  // namespace ravencal::exchange
