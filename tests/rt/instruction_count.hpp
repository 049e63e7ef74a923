// SPDX-License-Identifier: Apache-2.0
//
// Exact instruction counts of a piece of code, by stepping a child process through it one
// instruction at a time. Unlike time, they do not depend on what else the machine does.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace ravencal::test {

/// Runs setup(i), then piece(i) for i below `count`, in a child process; returns how many
/// instructions each piece took, every one with the same few of the marks around it. Empty if the
/// system does not allow tracing or the child ended early.
std::vector<std::uint64_t> count_instructions(int count, const std::function<void(int)>& setup,
                                              const std::function<void(int)>& piece);

}  // namespace ravencal::test
