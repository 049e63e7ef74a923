// SPDX-License-Identifier: Apache-2.0
//
// What every number on a command line must be, whatever else its option asks for.
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace ravencal::cli {

/// Largest magnitude of a real number that an option takes. No quantity of the project comes near
/// it, in any unit (1e12 ms are 32 years), and in ns or cycles it still fits 64 bits.
inline constexpr double kLargestNumber = 1e12;

/// Lets every option of `app` and of its commands that takes a number refuse NaN, infinities, real
/// numbers beyond kLargestNumber, and whole numbers that the option's type does not hold. Call it
/// when every option is there.
void check_numbers(CLI::App& app);

/// The number with which a text begins, within those that an option takes, and what follows it:
/// "30deg" is 30 and "deg". Nothing where there is none.
std::optional<std::pair<double, std::string>> leading_number(const std::string& text);

/// For an option whose number is 0 or more. CLI11's own names the largest double in its complaint.
CLI::Validator not_negative();

/// For an option whose number is more than 0.
CLI::Validator positive();

}  // namespace ravencal::cli
