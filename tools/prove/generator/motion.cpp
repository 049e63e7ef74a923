// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace ravencal::prove {

void Path::add(double to, double speed, double ramp_s) {
  const double begin_s = moves_.empty() ? 0.0 : moves_.back().begin_s + moves_.back().length_s;
  const double from = moves_.empty() ? to : moves_.back().to;
  const double ramp = std::max(ramp_s, 1e-3);
  moves_.push_back(
      {begin_s, std::max(std::abs(to - from) / speed + ramp, 2.0 * ramp), ramp, from, to});
}

std::string_view word_of(MotionKind kind) {
  constexpr std::array<std::string_view, 4> kWords = {"slow", "rich", "fast", "one way"};
  return kWords[static_cast<std::size_t>(kind)];
}

/// From end to end of the range in as many moves as fit in time, each followed by a hold.
void Path::go_one_way(const MotionRange& range, double duration_s, bool up, Random& random) {
  const double from = up ? range.low : range.high, to = up ? range.high : range.low;
  const double mean_speed = 0.5 * (range.slowest + range.fastest);
  const int count = std::max(3, static_cast<int>(duration_s / 20.0));
  const double slot_s = duration_s / count;
  moves_ = {{0.0, 0.3, 0.1, from, from}};
  for (int n = 0; n < count; ++n) {
    const double goal = from + (to - from) * (n + 1) / count;
    const double speed = std::max(mean_speed * random.uniform(0.5, 1.5),
                                  1.2 * std::abs(goal - moves_.back().to) / slot_s);
    add(goal, speed, 0.2);
    const double begin_s = moves_.back().begin_s + moves_.back().length_s;
    const double hold_s = std::max(0.1, slot_s * (n + 1) - begin_s);
    moves_.push_back({begin_s, hold_s, 0.05, goal, goal});
  }
}

Path::Path(const MotionRange& range, MotionKind kind, double duration_s, Random random) {
  const double span = range.high - range.low;
  moves_.push_back({0.0, 0.3, 0.1, range.low + span * random.uniform(), 0.0});
  moves_.back().to = moves_.back().from;
  bool up = random.uniform() < 0.5;
  if (kind == MotionKind::kOneWay) {
    go_one_way(range, duration_s, up, random);
    return;
  }
  while (moves_.back().begin_s + moves_.back().length_s <= duration_s) {
    const double speed = random.uniform(range.slowest, range.fastest);
    if (kind == MotionKind::kSlow) {
      const double depth = 0.35 * random.uniform();
      add(up ? range.high - depth * span : range.low + depth * span, speed, 0.25);
      up = !up;
      continue;
    }
    if (kind == MotionKind::kFast) {
      add(random.uniform(range.low, range.high), speed * random.log_uniform(3.0, 8.0),
          random.uniform(0.15, 0.3));
      continue;
    }
    const double choice = random.uniform();
    if (choice < 0.15) {  // a hold
      moves_.push_back({moves_.back().begin_s + moves_.back().length_s, random.uniform(2.0, 8.0),
                        0.1, moves_.back().to, moves_.back().to});
    } else if (choice < 0.45) {  // nested reversals, smaller and smaller
      double width = span * random.uniform(0.1, 0.3);
      const double centre = std::clamp(moves_.back().to, range.low + width, range.high - width);
      for (int n = 0; n < 5; ++n, width *= 0.55) {
        add(centre + (n % 2 == 0 ? width : -width), speed * random.uniform(0.4, 1.5), 0.2);
      }
    } else {
      add(random.uniform(range.low, range.high), speed * random.log_uniform(0.15, 4.0),
          random.uniform(0.08, 0.4));
    }
  }
}

double Path::at(double t_s) const {
  const auto next = std::upper_bound(moves_.begin(), moves_.end(), t_s,
                                     [](double t, const Move& m) { return t < m.begin_s; });
  const Move& m = next == moves_.begin() ? moves_.front() : *(next - 1);
  const double t = std::clamp(t_s - m.begin_s, 0.0, m.length_s);
  const double speed = (m.to - m.from) / (m.length_s - m.ramp_s);
  if (t < m.ramp_s) return m.from + 0.5 * speed * t * t / m.ramp_s;
  const double left = m.length_s - t;
  if (left < m.ramp_s) return m.to - 0.5 * speed * left * left / m.ramp_s;
  return m.from + speed * (t - 0.5 * m.ramp_s);
}

}  // namespace ravencal::prove
