// SPDX-License-Identifier: Apache-2.0
#include "monitor/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "plugin_host/plugin_library.hpp"

namespace ravencal::monitor {
namespace {

constexpr std::array kBlocks = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr std::array kAsciiBlocks = {" ", ".", ":", "-", "=", "+", "*", "#", "@"};

constexpr std::array<JointUnits, RAVENCAL_JOINTS> kJointUnits = {{
    {"shoulder", "rad", "deg", core::kDegPerRad},
    {"elbow", "rad", "deg", core::kDegPerRad},
    {"insertion", "m", "mm", 1e3},
}};

}  // namespace

void History::add(std::uint64_t step, double value) {
  if (!std::isfinite(value)) return;
  if (steps_.empty() || steps_.back().number != step) steps_.push_back({step, value, value});
  Step& last = steps_.back();
  last.lowest = std::min(last.lowest, value);
  last.highest = std::max(last.highest, value);
  while (steps_.front().number + kSteps <= step) steps_.pop_front();
}

double History::highest() const {
  double highest = 0.0;
  for (const Step& step : steps_) highest = std::max(highest, step.highest);
  return highest;
}

std::string History::sparkline(bool ascii) const {
  const auto& blocks = ascii ? kAsciiBlocks : kBlocks;
  if (steps_.empty()) return std::string(kSteps, ' ');
  double low = steps_.front().lowest;
  double high = steps_.front().highest;
  for (const Step& step : steps_) {
    low = std::min(low, step.lowest);
    high = std::max(high, step.highest);
  }
  std::string line;
  auto step = steps_.begin();
  for (std::size_t i = 0; i < kSteps; ++i) {
    const std::uint64_t number = steps_.back().number + i + 1;  // of kSteps steps ago, and on
    if (step == steps_.end() || step->number + kSteps != number) {
      line += " ";
      continue;
    }
    const double share = high > low ? (step->highest - low) / (high - low) : 0.0;
    line += blocks[1 + static_cast<std::size_t>(share * static_cast<double>(blocks.size() - 2))];
    ++step;
  }
  return line;
}

void Watch::take(const NumberedTick& tick, std::uint32_t tick_ns) {
  if (expected_ && tick.number > *expected_) missed_ += tick.number - *expected_;
  expected_ = tick.number + 1;
  newest_ = tick;
  ++taken_;
  const std::uint64_t step = tick.number * tick_ns / History::kStepNs;
  for (std::size_t j = 0; j < correction_.size(); ++j) {
    correction_[j].add(step, static_cast<double>(tick.tick.correction_ji[j]));
  }
  step_us_.add(step, static_cast<double>(tick.tick.step_ns) / 1e3);
}

void Watch::end_poll(double now_s) {
  const bool came = taken_ != taken_before_;
  taken_before_ = taken_;
  now_s_ = now_s;
  if (came || !looked_) came_s_ = now_s;
  fresh_ = fresh_ || (came && looked_);
  looked_ = true;
}

std::string Watch::state() const {
  const ravencal_tick& tick = newest_->tick;
  if (is_stalled()) return "stalled";
  const char* const name = plugin_host::state_name(tick.state);
  if (tick.state != RAVENCAL_STATE_SHADOW) return name;
  return fmt::format("{} (would be {})", name, plugin_host::state_name(tick.would_be_state));
}

void Watch::begin_writer() {
  looked_ = fresh_ = false;
  expected_ = 0;
  homing_constant_ = {};
  for (History& history : correction_) history.clear();
  step_us_.clear();
}

std::vector<std::string> doubts_in_words(std::uint32_t doubts) {
  std::vector<std::string> words;
  for (std::size_t kind = 0; kind < RAVENCAL_DOUBT_CAPACITY; ++kind) {
    if (((doubts >> kind) & 1U) != 0) words.emplace_back(plugin_host::doubt_name(kind));
  }
  return words;
}

const JointUnits& units_of(std::size_t joint) { return kJointUnits[joint]; }

}  // namespace ravencal::monitor
