// SPDX-License-Identifier: Apache-2.0
//
// The decoder against the encoder, for any motion, start and loss.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstdlib>
#include <set>
#include <vector>

#include "quadrature_reader/decoder.hpp"
#include "quadrature_reader/encode.hpp"

namespace ravencal::quadrature_reader {
namespace {

using Kind = DecoderStep::Kind;

/// Any motion as counts at instants 1 ms apart.
struct Motion {
  std::vector<std::int64_t> t_ns;
  std::vector<double> counts;
};

Motion any_motion() {
  const auto start = *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'000);
  const auto moves =
      *rc::gen::nonEmpty(rc::gen::container<std::vector<int>>(rc::gen::inRange(-40, 41)));
  Motion motion{{0}, {static_cast<double>(start)}};
  for (const int move : moves) {
    motion.t_ns.push_back(motion.t_ns.back() + 1'000'000);
    motion.counts.push_back(motion.counts.back() + 0.25 * move);
  }
  return motion;
}

/// A motion in one direction only, of at least 12 counts.
Motion steady_motion() {
  const auto start = *rc::gen::inRange<std::int64_t>(-1000, 1000);
  const auto length = *rc::gen::inRange(12, 60);
  const double direction = *rc::gen::element(-1.0, 1.0);
  return {{0, 1'000'000'000},
          {static_cast<double>(start), static_cast<double>(start) + direction * length}};
}

std::int64_t travelled(const Motion& motion) {
  return std::llround(motion.counts.back()) - std::llround(motion.counts.front());
}

/// Reference: the 16-entry table of every textbook, fed with complete line states.
class TableDecoder {
 public:
  void start(int levels) { state_ = levels & 3; }
  void edge(const Reading& edge) {
    const int bit = edge.line == Line::kA ? 1 : 2;
    const int next = edge.value != 0 ? state_ | bit : state_ & ~bit;
    // Index: old state << 2 | new state, state = A | B << 1; forward is 0 1 3 2 0.
    static constexpr std::array<int, 16> kTable = {0, 1, -1, 0,  -1, 0,  0, 1,
                                                   1, 0, 0,  -1, 0,  -1, 1, 0};
    count_ += kTable[static_cast<std::size_t>(state_ << 2 | next)];
    state_ = next;
  }
  [[nodiscard]] std::int64_t count() const { return count_; }

 private:
  int state_ = 0;
  std::int64_t count_ = 0;
};

DecoderStep feed(QuadratureDecoder& decoder, const Reading& reading) {
  if (reading.kind == ReadingKind::kLevels)
    return decoder.on_levels((reading.value & 1) != 0, (reading.value & 2) != 0);
  return decoder.on_edge(reading.line, reading.value != 0);
}

struct Outcome {
  std::int64_t count = 0;
  int anomalies = 0;
};

Outcome decode(const std::vector<Reading>& readings) {
  QuadratureDecoder decoder;
  Outcome outcome;
  for (const auto& reading : readings) {
    const Kind kind = feed(decoder, reading).kind;
    outcome.anomalies +=
        kind == Kind::kRepeated || kind == Kind::kRepaired || kind == Kind::kResync ? 1 : 0;
  }
  outcome.count = decoder.count();
  return outcome;
}

Reading levels_after(const std::vector<Reading>& readings) {
  std::int64_t levels = readings.front().value;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const std::int64_t bit = std::int64_t{1} << static_cast<unsigned>(readings[i].line);
    levels = readings[i].value != 0 ? levels | bit : levels & ~bit;
  }
  return {readings.back().t_ns + 1, levels, 0, ReadingKind::kLevels, Line::kA, Fault::kNone};
}

RC_GTEST_PROP(DecoderProperty, DecodesAnyMotionFromAnyStart, ()) {
  const Motion motion = any_motion();
  const auto outcome = decode(encode_motion(motion.t_ns, motion.counts, {}));
  RC_ASSERT(outcome.count == travelled(motion));
  RC_ASSERT(outcome.anomalies == 0);
}

RC_GTEST_PROP(DecoderProperty, AgreesWithATransitionTableAtEveryEdge, ()) {
  const Motion motion = any_motion();
  const auto readings = encode_motion(motion.t_ns, motion.counts, {});
  QuadratureDecoder decoder;
  TableDecoder reference;
  reference.start(static_cast<int>(readings.front().value));
  feed(decoder, readings.front());
  for (std::size_t i = 1; i < readings.size(); ++i) {
    feed(decoder, readings[i]);
    reference.edge(readings[i]);
    RC_ASSERT(decoder.count() == reference.count());
  }
}

RC_GTEST_PROP(DecoderProperty, NeedsNoLevelsAtTheStartOnceBothLinesHaveMoved, ()) {
  const Motion motion = steady_motion();
  auto readings = encode_motion(motion.t_ns, motion.counts, {});
  readings.erase(readings.begin());
  // The first edge of a line also tells where the line was before it.
  RC_ASSERT(decode(readings).count == travelled(motion));
}

RC_GTEST_PROP(DecoderProperty, JitterOnAnEdgeLeavesTheCountAlone, ()) {
  const Motion motion = any_motion();
  auto readings = encode_motion(motion.t_ns, motion.counts, {});
  RC_PRE(readings.size() > 1U);
  const auto at = *rc::gen::inRange<std::size_t>(1, readings.size());
  const auto bounces = *rc::gen::inRange(1, 5);
  Reading back = readings[at];
  back.value = 1 - back.value;
  for (int i = 0; i < bounces; ++i) {
    const auto here = readings.begin() + static_cast<std::ptrdiff_t>(at) + 1;
    readings.insert(here, {back, readings[at]});
  }
  const auto outcome = decode(readings);
  RC_ASSERT(outcome.count == travelled(motion));
  RC_ASSERT(outcome.anomalies == 0);
}

RC_GTEST_PROP(DecoderProperty, FindsEveryDroppedEdge, ()) {
  const Motion motion = any_motion();
  auto readings = encode_motion(motion.t_ns, motion.counts, {});
  RC_PRE(readings.size() > 1U);
  const Reading final_levels = levels_after(readings);
  const auto at = *rc::gen::inRange<std::size_t>(1, readings.size());
  readings.erase(readings.begin() + static_cast<std::ptrdiff_t>(at));
  // Where the line never moves again, reading its level is what finds it.
  readings.push_back(final_levels);
  const auto outcome = decode(readings);
  RC_ASSERT(outcome.anomalies >= 1);
  RC_ASSERT((outcome.count - travelled(motion)) % 4 == 0);
}

RC_GTEST_PROP(DecoderProperty, FindsEveryDoubledEdgeAndDoesNotCountIt, ()) {
  const Motion motion = any_motion();
  auto readings = encode_motion(motion.t_ns, motion.counts, {});
  RC_PRE(readings.size() > 1U);
  const auto at = *rc::gen::inRange<std::size_t>(1, readings.size());
  readings.insert(readings.begin() + static_cast<std::ptrdiff_t>(at), readings[at]);
  const auto outcome = decode(readings);
  RC_ASSERT(outcome.anomalies >= 1);
  RC_ASSERT(outcome.count == travelled(motion));
}

RC_GTEST_PROP(DecoderProperty, RepairsADroppedEdgeInSteadyMotion, ()) {
  const Motion motion = steady_motion();
  auto readings = encode_motion(motion.t_ns, motion.counts, {});
  // Not the first two edges, before which there is no direction, nor the last two, after which no
  // edge of that line comes.
  const auto at = *rc::gen::inRange<std::size_t>(3, readings.size() - 2);
  readings.erase(readings.begin() + static_cast<std::ptrdiff_t>(at));
  QuadratureDecoder decoder;
  for (const auto& reading : readings) feed(decoder, reading);
  RC_ASSERT(decoder.count() == travelled(motion));
  RC_ASSERT(decoder.uncertainty_counts() == 0);
}

RC_GTEST_PROP(DecoderProperty, BridgesACountedLossInSteadyMotion, ()) {
  const Motion motion = steady_motion();
  const auto readings = encode_motion(motion.t_ns, motion.counts, {});
  const auto from = *rc::gen::inRange<std::size_t>(3, readings.size() - 3);
  const auto lost = *rc::gen::inRange<std::size_t>(1, readings.size() - 2 - from);
  QuadratureDecoder decoder;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (i == from) decoder.on_lost(static_cast<std::int64_t>(lost));
    if (i < from || i >= from + lost) feed(decoder, readings[i]);
  }
  RC_ASSERT(decoder.count() == travelled(motion));
  RC_ASSERT(decoder.uncertainty_counts() == 0);
}

RC_GTEST_PROP(DecoderProperty, NeverTrustsTheCountAfterALossThatNobodyCounted, ()) {
  const Motion motion = any_motion();
  const auto readings = encode_motion(motion.t_ns, motion.counts, {});
  const auto keep = *rc::gen::inRange<std::size_t>(1, readings.size() + 1);
  QuadratureDecoder decoder;
  for (std::size_t i = 0; i < keep; ++i) feed(decoder, readings[i]);
  decoder.on_lost(0);
  feed(decoder, levels_after(readings));
  RC_ASSERT(decoder.uncertainty_counts() == QuadratureDecoder::kUnbounded);
  RC_ASSERT((decoder.count() - travelled(motion)) % 4 == 0);
}

RC_GTEST_PROP(DecoderProperty, StaysCongruentWithTheLevelsWhateverIsLost, ()) {
  const Motion motion = any_motion();
  auto readings = encode_motion(motion.t_ns, motion.counts, {});
  const Reading final_levels = levels_after(readings);
  const auto drops = *rc::gen::container<std::set<std::size_t>>(
      rc::gen::inRange<std::size_t>(1, readings.size() + 1));
  std::vector<Reading> kept;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (i == 0 || !drops.contains(i)) kept.push_back(readings[i]);
  }
  kept.push_back(final_levels);
  RC_ASSERT((decode(kept).count - travelled(motion)) % 4 == 0);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
