// SPDX-License-Identifier: Apache-2.0
#include "record/stamps.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "core/units.hpp"

namespace ravencal::record {
namespace {

constexpr std::int64_t kDayNs = 86'400'000'000'000;
// int64 nanoseconds reach 292 years; leave room for sums.
constexpr double kMaxTimeNs = 9e18;
/// A step of so many steps of rounding is a gap in the rows.
constexpr std::int64_t kGapSteps = 3;

/// Reads text from its front.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  [[nodiscard]] bool at_end() const { return text_.empty(); }
  bool take(std::string_view any_of) {
    if (text_.empty() || any_of.find(text_.front()) == std::string_view::npos) return false;
    text_.remove_prefix(1);
    return true;
  }
  std::optional<int> number(std::size_t fewest, std::size_t most) {
    const std::size_t digits =
        std::min({text_.find_first_not_of("0123456789"), text_.size(), most});
    if (digits < fewest) return std::nullopt;
    int value = 0;
    std::from_chars(text_.data(), text_.data() + digits, value);
    text_.remove_prefix(digits);
    return value;
  }
  /// Digits behind the point, in ns.
  std::int64_t fraction_ns() {
    std::int64_t ns = 0;
    std::int64_t weight = 100'000'000;
    while (!text_.empty() && text_.front() >= '0' && text_.front() <= '9') {
      ns += weight * (text_.front() - '0');
      weight /= 10;
      text_.remove_prefix(1);
    }
    return ns;
  }

 private:
  std::string_view text_;
};

/// "hh:mm", "hh:mm:ss" or "hh:mm:ss.fff" in ns.
std::optional<std::int64_t> take_clock(Scanner& scanner) {
  const auto hours = scanner.number(1, 3);
  if (!hours || !scanner.take(":")) return std::nullopt;
  const auto minutes = scanner.number(2, 2);
  if (!minutes || *minutes > 59) return std::nullopt;
  std::int64_t ns = (*hours * 3600LL + *minutes * 60LL) * 1'000'000'000;
  if (!scanner.take(":")) return ns;
  const auto seconds = scanner.number(2, 2);
  if (!seconds || *seconds > 60) return std::nullopt;
  ns += *seconds * 1'000'000'000LL;
  if (scanner.take(".,")) ns += scanner.fraction_ns();
  return ns;
}

std::optional<std::int64_t> take_date(Scanner& scanner) {
  const auto year = scanner.number(4, 4);
  if (!year || !scanner.take("-/")) return std::nullopt;
  const auto month = scanner.number(1, 2);
  if (!month || !scanner.take("-/")) return std::nullopt;
  const auto day = scanner.number(1, 2);
  if (!day) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok() || !scanner.take("T t_")) return std::nullopt;
  const auto clock_ns = take_clock(scanner);
  if (!clock_ns) return std::nullopt;
  std::int64_t ns = std::chrono::sys_days(date).time_since_epoch().count() * kDayNs + *clock_ns;
  (void)scanner.take(" ");
  if (scanner.take("Zz")) return ns;
  const bool is_ahead = scanner.take("+");
  if (!is_ahead && !scanner.take("-")) return ns;
  const auto hours = scanner.number(2, 2);
  (void)scanner.take(":");
  const auto minutes = scanner.at_end() ? std::optional(0) : scanner.number(2, 2);
  if (!hours || !minutes) return std::nullopt;
  const std::int64_t offset_ns = (*hours * 60LL + *minutes) * 60'000'000'000;
  return ns + (is_ahead ? -offset_ns : offset_ns);
}

std::optional<std::int64_t> whole_ns(double t_ns) {
  if (!(std::abs(t_ns) < kMaxTimeNs)) return std::nullopt;
  return std::llround(t_ns);
}

double ns_per(std::string_view unit) { return core::find_unit(unit)->to_si * kNsPerS; }

/// What a row's fields say, before the starts from 0 are counted.
std::optional<std::int64_t> stamp_of(const Clock& clock, const StampFields& fields,
                                     std::size_t row) {
  if (is_written_out(clock.unit)) return ns_of_text(clock.unit, fields.words[row]);
  const auto whole = whole_ns(fields.numbers[row] * ns_per(clock.unit));
  if (fields.fractions.empty() || !whole) return whole;
  const auto fraction = whole_ns(fields.fractions[row] * ns_per(clock.fraction_unit));
  if (!fraction) return std::nullopt;
  return *whole + *fraction;
}

/// The line t = first + rate * row of these stamps, if none is further from it than a step.
bool spread_evenly(std::span<std::int64_t> t_ns, std::int64_t step_ns) {
  const auto count = static_cast<double>(t_ns.size());
  double sum = 0.0, moment = 0.0;
  for (std::size_t i = 0; i < t_ns.size(); ++i) {
    const auto since = static_cast<double>(t_ns[i] - t_ns.front());
    sum += since;
    moment += since * (static_cast<double>(i) - 0.5 * (count - 1.0));
  }
  const double rate = moment * 12.0 / (count * (count * count - 1.0));
  const double first = sum / count - rate * 0.5 * (count - 1.0);
  std::vector<std::int64_t> line;
  for (std::size_t i = 0; i < t_ns.size(); ++i) {
    line.push_back(t_ns.front() + std::llround(first + rate * static_cast<double>(i)));
    if (std::abs(line.back() - t_ns[i]) > step_ns) return false;
  }
  std::copy(line.begin(), line.end(), t_ns.begin());
  return true;
}

void spread_equal(std::span<std::int64_t> t_ns) {
  for (std::size_t from = 0; from < t_ns.size();) {
    std::size_t to = from;
    while (to < t_ns.size() && t_ns[to] == t_ns[from]) ++to;
    if (to == t_ns.size()) return;
    const std::int64_t first = t_ns[from];
    const auto rows = static_cast<std::int64_t>(to - from);
    for (std::int64_t i = 1; i < rows; ++i)
      t_ns[from + static_cast<std::size_t>(i)] = first + (t_ns[to] - first) * i / rows;
    from = to;
  }
}

}  // namespace

bool is_written_out(std::string_view unit) { return unit == "date" || unit == "clock"; }

std::optional<std::int64_t> ns_of_text(std::string_view unit, std::string_view text) {
  Scanner scanner(text);
  const auto ns = unit == "date" ? take_date(scanner) : take_clock(scanner);
  return scanner.at_end() ? ns : std::nullopt;
}

Stamps stamps_of(const Clock& clock, const StampFields& fields) {
  const std::size_t rows = is_written_out(clock.unit) ? fields.words.size() : fields.numbers.size();
  const std::int64_t wrap_ns = clock.unit == "clock" ? kDayNs
                               : clock.wraps_at > 0.0
                                   ? std::llround(clock.wraps_at * ns_per(clock.unit))
                                   : 0;
  Stamps stamps(rows);
  std::int64_t last_ns = 0;
  bool is_first = true;
  for (std::size_t row = 0; row < rows; ++row) {
    stamps[row] = stamp_of(clock, fields, row);
    if (!stamps[row] || wrap_ns == 0) continue;
    // The turn that lies nearest to the stamp before: one bad stamp shifts no other.
    if (!is_first) {
      const auto turns = static_cast<double>(last_ns - *stamps[row]) / static_cast<double>(wrap_ns);
      *stamps[row] += std::llround(turns) * wrap_ns;
    }
    is_first = false;
    last_ns = *stamps[row];
  }
  return stamps;
}

std::vector<bool> longest_rising(const Stamps& stamps) {
  std::vector<std::size_t> ends;  // [n]: the row with the smallest stamp that ends n + 1 rows
  std::vector<std::optional<std::size_t>> before(stamps.size());
  for (std::size_t row = 0; row < stamps.size(); ++row) {
    if (!stamps[row]) continue;
    const auto place =
        std::upper_bound(ends.begin(), ends.end(), *stamps[row],
                         [&](std::int64_t stamp, std::size_t end) { return stamp < *stamps[end]; });
    if (place != ends.begin()) before[row] = *(place - 1);
    if (place == ends.end())
      ends.push_back(row);
    else
      *place = row;
  }
  std::vector<bool> kept(stamps.size(), false);
  if (ends.empty()) return kept;
  for (std::optional<std::size_t> row = ends.back(); row; row = before[*row]) kept[*row] = true;
  return kept;
}

void spread_rounded(std::span<std::int64_t> t_ns, std::int64_t step_ns) {
  for (std::size_t from = 0; from < t_ns.size();) {
    std::size_t to = from + 1;
    while (to < t_ns.size() && t_ns[to] - t_ns[to - 1] <= kGapSteps * step_ns) ++to;
    const auto part = t_ns.subspan(from, to - from);
    if (part.size() > 2 && !spread_evenly(part, step_ns)) spread_equal(part);
    from = to;
  }
}

}  // namespace ravencal::record
