// SPDX-License-Identifier: Apache-2.0
//
// The instruction sets for which the training kernels are built. The default build targets any
// x86-64; the kernels alone are compiled several times and chosen at run time. Same seed, same
// weights holds per instruction set, because wider vectors add in another order.
#pragma once

#include <optional>
#include <string_view>

namespace ravencal::learn {

enum class Isa { kBaseline, kAvx2, kAvx512 };

/// "baseline", "avx2" (x86-64-v3) or "avx512" (x86-64-v4).
std::string_view name_of(Isa isa);
std::optional<Isa> isa_from(std::string_view name);

/// True if this build has kernels for `isa` and this processor can run them.
bool is_supported(Isa isa);

/// The widest supported instruction set.
Isa best_isa();

}  // namespace ravencal::learn
