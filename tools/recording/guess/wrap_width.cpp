// SPDX-License-Identifier: Apache-2.0
#include "guess/wrap_width.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.hpp"
#include "core/units.hpp"
#include "record/relation.hpp"

namespace ravencal::guess {
namespace {

/// Ordinary steps are below so many turns in nine rows of ten; faster motion cannot be told from
/// its mirror image.
constexpr double kOrdinaryTurns = 0.25;
/// A start on the nearest turn is a step of at most so many times the largest step near it: lost
/// rows and accelerations make it longer than those.
constexpr double kLikeNeighbours = 3.0;
/// Rows before and after a start that tell the motion through it.
constexpr std::size_t kNearRows = 3;
/// Of the steps beyond half a turn, so many are starts: wild values make such steps too.
constexpr double kShareOfStarts = 0.5;
/// Of the starts, so many lie in the direction of the motion around them: noise crosses the seam
/// once more in it than against it. A hand that toggles or a command that steps has hardly any.
constexpr double kShareDirected = 0.5;
/// Motion is clear from so many usual steps on, which noise seldom makes, within so many rows.
constexpr double kClearSteps = 3.0;
constexpr std::size_t kClearRows = 400;
/// Noise and small motion at the seam cross it by less than that, in no clear direction. A hand
/// toggles between 0 and 1, so that this tells nothing of the width 1.
constexpr double kSeamTurns = 0.05;
/// An unknown width takes so many starts, which agree within so much of it.
constexpr std::size_t kFewestStarts = 3;
constexpr double kWidthSpread = 0.02;
/// Counters have round widths: the roundest within so many spreads is taken.
constexpr double kWithinSpreads = 3.0;
/// One value more than one in so many may be wild at either end of the range, and is where it lies
/// so much of the range beyond the others.
constexpr std::size_t kRowsAWild = 1000;
constexpr double kBeyondRange = 0.05;

constexpr double kTurnDeg = 360.0;

/// Values without those that are lost, with the steps between them.
struct Steps {
  std::vector<double> values;
  std::vector<double> steps;
  double range = 0.0;
};

/// Leaves lost and wild values out.
Steps steps_of(const Eigen::VectorXd& values) {
  std::vector<double> finite;
  for (const double value : values)
    if (std::isfinite(value)) finite.push_back(value);
  std::vector<double> sorted = finite;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t spared = 1 + sorted.size() / kRowsAWild;
  const double low = sorted[spared], high = sorted[sorted.size() - 1 - spared];
  Steps out;
  for (const double value : finite) {
    const double beyond = std::max(low - value, value - high);
    if (beyond <= kBeyondRange * (high - low)) out.values.push_back(value);
  }
  const auto [lowest, highest] = std::minmax_element(out.values.begin(), out.values.end());
  out.range = *highest - *lowest;
  for (std::size_t i = 0; i + 1 < out.values.size(); ++i)
    out.steps.push_back(out.values[i + 1] - out.values[i]);
  return out;
}

/// What the steps beyond half a turn say of one width.
struct Starts {
  std::size_t far = 0;       ///< steps beyond half a turn
  std::size_t starts = 0;    ///< of them, those that are ordinary on the nearest turn
  std::size_t directed = 0;  ///< of them, those that go on in the direction of the motion
  std::size_t moved = 0;     ///< of them, those that are no whole turn
  double largest_turns = 0.0;
  std::vector<double> widths;  ///< of the directed ones: the motion around it less the step

  [[nodiscard]] bool are_enough() const {
    return starts > 0 && static_cast<double>(starts) >= kShareOfStarts * static_cast<double>(far);
  }
  [[nodiscard]] bool are_directed() const {
    return are_enough() &&
           static_cast<double>(directed) >= kShareDirected * static_cast<double>(starts);
  }
  [[nodiscard]] bool lie_at_the_seam() const {
    return are_enough() && moved == starts && largest_turns < kSeamTurns;
  }
};

/// The values on the nearest turn.
class Path {
 public:
  Path(const Steps& given, double turn) : path_(given.values.size(), 0.0) {
    std::vector<double> counts;
    for (std::size_t i = 0; i < given.steps.size(); ++i) {
      const double step = given.steps[i];
      folded_.push_back(step - turn * std::round(step / turn));
      path_[i + 1] = path_[i] + folded_[i];
      if (step != 0.0 && std::abs(step) <= 0.5 * turn) counts.push_back(std::abs(step));
    }
    if (!counts.empty()) usual_ = core::upper_median(std::move(counts));
  }

  [[nodiscard]] const std::vector<double>& folded() const { return folded_; }
  /// The middle step of those that are no start and not 0: slow counters stand still between two
  /// counts. 0: nothing else moves.
  [[nodiscard]] double usual() const { return usual_; }
  /// The largest step near one, it left out.
  [[nodiscard]] double largest_near(std::size_t step) const {
    double largest = usual_;
    const std::size_t to = std::min(folded_.size(), step + kNearRows + 1);
    for (std::size_t i = step - std::min(step, kNearRows); i < to; ++i)
      if (i != step) largest = std::max(largest, std::abs(folded_[i]));
    return largest;
  }
  /// 1 or -1: where the motion goes before and after the step; 0: nowhere, or to and fro.
  [[nodiscard]] int direction_at(std::size_t step) const {
    const int before = clear_motion(step, false), after = clear_motion(step + 1, true);
    return before * after < 0 ? 0 : std::clamp(before + after, -1, 1);
  }
  [[nodiscard]] double motion_through(std::size_t step) const {
    const std::size_t from = step - std::min<std::size_t>(step, 1);
    const std::size_t to = std::min(folded_.size() - 1, step + 1);
    double sum = 0.0;
    for (std::size_t i = from; i <= to; ++i) sum += i == step ? 0.0 : folded_[i];
    return to > from ? sum / static_cast<double>(to - from) : 0.0;
  }

 private:
  [[nodiscard]] int clear_motion(std::size_t row, bool ahead) const {
    for (std::size_t rows = kNearRows; rows < kClearRows; rows += 1 + rows / 4) {
      if (ahead ? row + rows >= path_.size() : row < rows) return 0;
      const double motion = ahead ? path_[row + rows] - path_[row] : path_[row] - path_[row - rows];
      if (std::abs(motion) > kClearSteps * usual_) return motion > 0.0 ? 1 : -1;
    }
    return 0;
  }

  std::vector<double> folded_;
  std::vector<double> path_;
  double usual_ = 0.0;
};

Starts starts_of(const Steps& given, double turn) {
  Starts out;
  const Path path(given, turn);
  std::vector<double> sizes;
  for (const double step : path.folded()) sizes.push_back(std::abs(step));
  std::vector<double> sorted = sizes;
  std::sort(sorted.begin(), sorted.end());
  if (path.usual() == 0.0 || sorted[sorted.size() * 9 / 10] > kOrdinaryTurns * turn) return out;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (std::abs(given.steps[i]) <= 0.5 * turn) continue;
    ++out.far;
    const double near = path.largest_near(i);
    if (sizes[i] > kLikeNeighbours * near || near > kOrdinaryTurns * turn) continue;
    ++out.starts;
    out.largest_turns = std::max(out.largest_turns, sizes[i] / turn);
    out.moved += sizes[i] > 0.0;
    if (path.direction_at(i) * given.steps[i] >= 0.0) continue;
    ++out.directed;
    out.widths.push_back(std::abs(path.motion_through(i) - given.steps[i]));
  }
  return out;
}

/// A whole turn in a unit of angle; 0 for others.
double turn_in(std::string_view unit) {
  const auto known = core::find_unit(unit);
  return known && known->si_name == "rad" ? kTurnRad / known->to_si : 0.0;
}

/// Widths that counters and angles have, in the unit that the name says.
std::vector<double> known_widths(bool whole_numbers, std::string_view unit) {
  if (turn_in(unit) > 0.0) return {turn_in(unit)};
  if (!unit.empty() && unit != "counts") return {};
  std::vector<double> widths = {kTurnDeg};
  // Radians, turns, tenths and hundredths of a degree, and 8 to 32 bits.
  if (!whole_numbers) widths.insert(widths.end(), {kTurnRad, 1.0});
  if (!whole_numbers && unit.empty()) return widths;
  widths.insert(widths.end(), {10.0 * kTurnDeg, 100.0 * kTurnDeg});
  for (int bits = 8; bits <= 32; ++bits) widths.push_back(std::exp2(bits));
  return widths;
}

/// The number with the fewest digits between two others that are above 0; a whole one where they
/// hold one and `whole_numbers` is asked for.
double roundest_between(double low, double high, bool whole_numbers) {
  for (double step = std::pow(10.0, std::ceil(std::log10(high))); step > 1e-12 * high;
       step /= 10.0) {
    for (const double part : {1.0, 0.5, 0.25, 0.1}) {
      const double value = std::ceil(low / (part * step)) * part * step;
      if (value <= high && (!whole_numbers || value == std::round(value))) return value;
    }
  }
  return whole_numbers ? std::round(0.5 * (low + high)) : 0.5 * (low + high);
}

/// The width that the starts say, and how far they are apart in it.
struct Widths {
  double middle = 0.0, spread = 0.0;
};
Widths middle_of(std::vector<double> widths) {
  Widths out{core::upper_median(widths), 0.0};
  for (double& width : widths) width = std::abs(width - out.middle);
  out.spread = core::upper_median(std::move(widths));
  return out;
}

/// Where several starts agree on a width, it is that one and not one nearby.
bool agree_on(const Starts& starts, double width) {
  if (starts.directed < kFewestStarts) return true;
  const Widths said = middle_of(starts.widths);
  return std::abs(said.middle - width) <=
         std::max(kWidthSpread * width, kWithinSpreads * said.spread);
}

std::optional<double> estimated_width(const Steps& steps, bool whole_numbers,
                                      std::string_view unit) {
  // The values of a counter that started again several times fill its range.
  const Starts starts = starts_of(steps, steps.range * (1.0 + kRangeRounding));
  if (!starts.are_directed() || starts.directed < kFewestStarts) return std::nullopt;
  const auto [middle, spread] = middle_of(starts.widths);
  if (spread > kWidthSpread * middle) return std::nullopt;
  const double least = whole_numbers ? steps.range + 1.0 : steps.range;
  const double most = std::max(least, middle + kWithinSpreads * spread);
  if (middle < least * (1.0 - kWidthSpread)) return std::nullopt;
  const double low = std::max(least, 2.0 * middle - most);
  const double turn = turn_in(unit);
  // Behind a gearbox, a motor's turn is a whole part of the joint's, and an encoder may count a
  // few.
  if (turn > 0.0) {
    for (const double whole : {turn * std::ceil(low / turn), turn / std::floor(turn / low)})
      if (std::isfinite(whole) && whole >= low && whole <= most) return whole;
  }
  return roundest_between(low, most, whole_numbers);
}

}  // namespace

std::optional<Wrap> wrap_of(const Eigen::VectorXd& values, bool whole_numbers,
                            std::string_view unit) {
  if (values.array().isFinite().count() < record::kFewestRows) return std::nullopt;
  const Steps steps = steps_of(values);
  if (!(steps.range > 0.0) || static_cast<Eigen::Index>(steps.steps.size()) < record::kFewestRows)
    return std::nullopt;
  for (const double width : known_widths(whole_numbers, unit)) {
    // Whole numbers of one turn differ by less than it.
    const double range = whole_numbers ? steps.range + 1.0 : steps.range;
    if (range > width * (1.0 + kRangeRounding) || 2.0 * steps.range < width) continue;
    const Starts starts = starts_of(steps, width);
    if ((starts.are_directed() && agree_on(starts, width)) ||
        (starts.lie_at_the_seam() && width != 1.0))
      return Wrap{width, false};
  }
  const auto width = estimated_width(steps, whole_numbers, unit);
  return width ? std::optional(Wrap{*width, true}) : std::nullopt;
}

}  // namespace ravencal::guess
