// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/decoder.hpp"

#include <cassert>
#include <cstdlib>

namespace ravencal::quadrature_reader {
namespace {

constexpr int kA = 0;
constexpr int kB = 1;

/// Position within one cycle of four counts.
int phase_of(bool a, bool b) { return a ? (b ? 2 : 1) : (b ? 3 : 0); }

/// The representative of `delta` modulo 4 in -1, 0, 1, 2.
int smallest_residue(int delta) {
  const int residue = ((delta % 4) + 4) % 4;
  return residue == 3 ? -1 : residue;
}

bool congruent_modulo_4(std::int64_t x, std::int64_t y) { return (x - y) % 4 == 0; }

}  // namespace

int phase_step(std::int64_t from_levels, std::int64_t to_levels) {
  const auto phase = [](std::int64_t levels) {
    return phase_of((levels & 1) != 0, (levels & 2) != 0);
  };
  return smallest_residue(phase(to_levels) - phase(from_levels));
}

DecoderStep QuadratureDecoder::on_edge(Line line, bool level) {
  assert(line != Line::kZ);
  const int own = line == Line::kA ? kA : kB;
  const int other = 1 - own;
  if (known_[own] && level_[own] == level) return repeated_edge(own);
  if (!known_[own]) after_gap_[own] = !level;
  level_[own] = level;
  known_[own] = true;
  other_edges_[own] = 0;
  ++other_edges_[other];
  if (!known_[other]) return {};
  if (gap_open_ || !started_) return settle(own);

  const bool forward = own == kA ? level_[kA] != level_[kB] : level_[kA] == level_[kB];
  direction_ = forward ? 1 : -1;
  count_ += direction_;
  return {direction_, DecoderStep::Kind::kStep};
}

DecoderStep QuadratureDecoder::repeated_edge(int line) {
  const int between = other_edges_[line];
  other_edges_[line] = 0;
  if (!levels_known() || gap_open_) return {0, DecoderStep::Kind::kRepeated};
  ++other_edges_[1 - line];
  if (between == 0)
    return {0, DecoderStep::Kind::kRepeated};  // doubled, or there and back: net zero
  if (between == 2 && direction_ != 0) {
    // A B (A) B A with the middle A lost is the only reading without a reversal. The second B was
    // taken for a step back, so the motion's direction is the opposite of the last one.
    direction_ = -direction_;
    count_ += std::int64_t{4} * direction_;
    return {std::int64_t{4} * direction_, DecoderStep::Kind::kRepaired};
  }
  add_uncertainty(4);
  return {0, DecoderStep::Kind::kRepeated};
}

DecoderStep QuadratureDecoder::on_levels(bool a, bool b) {
  const bool read[2] = {a, b};
  if (levels_known() && !gap_open_ && started_) {
    if (level_[kA] == a && level_[kB] == b) return {};
    // Edges went missing without a sign: at least as many as the levels differ by.
    on_lost(std::abs(smallest_residue(phase_of(a, b) - phase_of(level_[kA], level_[kB]))));
    add_uncertainty(4);
  }
  for (int line : {kA, kB}) {
    if (!known_[line]) after_gap_[line] = read[line];
    known_[line] = true;
    level_[line] = read[line];
    other_edges_[line] = 0;
  }
  return settle(kB);
}

void QuadratureDecoder::on_lost(std::int64_t edges) {
  assert(edges >= 0);
  if (!gap_open_) {
    if (started_ && levels_known()) phase_before_gap_ = phase_of(level_[kA], level_[kB]);
    lost_edges_ = 0;
    lost_unknown_ = false;
  }
  gap_open_ = true;
  unseen_counts_.reset();
  lost_edges_ += edges;
  lost_unknown_ = lost_unknown_ || edges == 0;
  known_[kA] = known_[kB] = false;
}

void QuadratureDecoder::on_unseen(std::int64_t movement_counts, std::int64_t uncertainty) {
  const bool alone = !gap_open_;
  on_lost(std::abs(movement_counts));
  // Within a gap that is open already nothing tells where the movement began.
  if (!alone) return;
  unseen_counts_ = movement_counts;
  if (movement_counts != 0) direction_ = movement_counts > 0 ? 1 : -1;
  add_uncertainty(uncertainty);
}

DecoderStep QuadratureDecoder::settle(int last_line) {
  // Only one line can have moved since the gap, there and back, before the last edge of the other.
  bool between[2] = {level_[kA], level_[kB]};
  between[last_line] = after_gap_[last_line];
  const int phase_after_gap = phase_of(after_gap_[kA], after_gap_[kB]);
  const int phase_between = phase_of(between[kA], between[kB]);
  const int last_step = smallest_residue(phase_of(level_[kA], level_[kB]) - phase_between);
  const int since_gap = smallest_residue(phase_between - phase_after_gap) + last_step;
  const bool first = !started_;
  std::int64_t delta = since_gap;
  if (!first && gap_open_ && unseen_counts_) {
    delta += *unseen_counts_;
  } else if (!first && gap_open_) {
    const int residue = smallest_residue(phase_after_gap - phase_before_gap_);
    const std::int64_t steady = direction_ * lost_edges_;
    if (!lost_unknown_ && direction_ != 0 && congruent_modulo_4(steady, residue)) {
      delta += steady;
    } else {
      delta += residue;
      add_uncertainty(lost_unknown_ ? kUnbounded : lost_edges_ + std::abs(residue));
    }
  }
  started_ = true;
  gap_open_ = false;
  unseen_counts_.reset();
  if (last_step != 0) direction_ = last_step;
  count_ += delta;
  return {delta, first ? DecoderStep::Kind::kNone : DecoderStep::Kind::kResync};
}

void QuadratureDecoder::add_uncertainty(std::int64_t counts) {
  const bool unbounded = counts == kUnbounded || uncertainty_counts_ == kUnbounded;
  uncertainty_counts_ = unbounded ? kUnbounded : uncertainty_counts_ + counts;
}

}  // namespace ravencal::quadrature_reader
