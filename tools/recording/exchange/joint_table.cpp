// SPDX-License-Identifier: Apache-2.0
#include "exchange/joint_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "exchange/joint_axis.hpp"

namespace ravencal::exchange {
namespace {

/// What comes more rarely, beside the publisher of most messages, is no state of a robot that moves
/// but an event. No source: a choice, below a slow arm beside a fast gripper.
constexpr std::size_t kRarest = 20;
constexpr std::size_t kNamesShown = 6;

std::string names_of(const std::vector<std::string>& joints) {
  if (joints.size() <= kNamesShown) return fmt::format("{}", fmt::join(joints, ", "));
  return fmt::format("{} and {} more",
                     fmt::join(joints.begin(), joints.begin() + kNamesShown, ", "),
                     joints.size() - kNamesShown);
}

bool share_joint(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  return std::any_of(a.begin(), a.end(), [&](const std::string& joint) {
    return std::find(b.begin(), b.end(), joint) != b.end();
  });
}

/// A set that may give the rows, with those that come in its sweeps.
struct Axis {
  std::size_t main = 0;
  std::vector<std::size_t> sets;    ///< `main` among them, in the order of the file
  std::vector<std::string> joints;  ///< of all of them
  std::size_t columns = 0;
};

class JointTable {
 public:
  JointTable(std::vector<JointSet> sets, record::Table& table)
      : sets_(std::move(sets)), table_(table) {}

  void fill() {
    const Axis axis = best_axis();
    const JointSet& main = sets_[axis.main];
    table_.t_ns = main.t_ns;
    for (const std::size_t i : axis.sets) {
      if (i == axis.main)
        put(main, [](const JointColumn& column) { return column.values; });
      else
        put_sweep(sets_[i], i < axis.main);
    }
    for (const std::size_t i : others(axis)) put_other(sets_[i]);
    say(axis);
  }

 private:
  [[nodiscard]] Axis axis_of(std::size_t main) const;
  [[nodiscard]] bool is_before(const Axis& a, const Axis& b) const;
  [[nodiscard]] Axis best_axis() const;
  [[nodiscard]] std::vector<std::size_t> others(const Axis& axis) const;
  void put_sweep(const JointSet& set, bool is_first);
  void put_other(const JointSet& set);
  template <typename ValuesOf>
  void put(const JointSet& set, ValuesOf&& values_of);
  void say(const Axis& axis);

  std::vector<JointSet> sets_;
  record::Table& table_;
  std::map<std::string, std::vector<std::string>> joints_of_topic_;
  /// The column that measures a joint's quantity, and the type of its message.
  std::map<std::pair<std::string, std::string>, std::pair<std::string, JointMessageType>> measured_;
  std::vector<std::string> interpolated_;  ///< sets, as the next
  std::vector<std::string> left_out_;
};

Axis JointTable::axis_of(std::size_t main) const {
  Axis axis{main, {}, sets_[main].joints, sets_[main].columns.size()};
  for (std::size_t i = 0; i < sets_.size(); ++i) {
    const bool fits = i == main || (sets_[i].topic == sets_[main].topic &&
                                    !share_joint(axis.joints, sets_[i].joints) &&
                                    sweep_of(sets_[main].t_ns, sets_[i].t_ns, i < main));
    if (!fits) continue;
    axis.sets.push_back(i);
    if (i == main) continue;
    axis.joints.insert(axis.joints.end(), sets_[i].joints.begin(), sets_[i].joints.end());
    axis.columns += sets_[i].columns.size();
  }
  return axis;
}

bool JointTable::is_before(const Axis& a, const Axis& b) const {
  const JointSet &x = sets_[a.main], &y = sets_[b.main];
  if (share_joint(a.joints, b.joints)) {
    return std::tuple(y.type, x.t_ns.size(), a.joints.size()) >
           std::tuple(x.type, y.t_ns.size(), b.joints.size());
  }
  return std::tuple(a.joints.size(), a.columns, x.t_ns.size()) >
         std::tuple(b.joints.size(), b.columns, y.t_ns.size());
}

Axis JointTable::best_axis() const {
  std::size_t most = 0;
  for (const JointSet& set : sets_) most = std::max(most, set.t_ns.size());
  std::optional<Axis> best;
  for (std::size_t i = 0; i < sets_.size(); ++i) {
    if (sets_[i].t_ns.size() * kRarest < most) continue;
    Axis axis = axis_of(i);
    if (!best || is_before(axis, *best)) best = std::move(axis);
  }
  return *best;
}

std::vector<std::size_t> JointTable::others(const Axis& axis) const {
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < sets_.size(); ++i) {
    if (std::find(axis.sets.begin(), axis.sets.end(), i) == axis.sets.end()) others.push_back(i);
  }
  std::stable_sort(others.begin(), others.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(sets_[a].type, sets_[b].t_ns.size()) <
           std::tuple(sets_[b].type, sets_[a].t_ns.size());
  });
  return others;
}

template <typename ValuesOf>
void JointTable::put(const JointSet& set, ValuesOf&& values_of) {
  auto& placed = joints_of_topic_[set.topic];
  placed.insert(placed.end(), set.joints.begin(), set.joints.end());
  constexpr std::string_view kActual = "actual/";
  for (const JointColumn& column : set.columns) {
    std::string words = fmt::format("{}/{}", column.joint, column.quantity);
    std::string name = fmt::format("{}/{}", set.topic, words);
    const bool is_actual = column.quantity.starts_with(kActual);
    const bool is_said = std::any_of(column.values.begin(), column.values.end(),
                                     [](double value) { return std::isfinite(value); });
    if (is_said) {
      const auto [it, is_new] = measured_.try_emplace(
          {column.joint, column.quantity.substr(is_actual ? kActual.size() : 0)}, name, set.type);
      if (!is_new && it->second.second != set.type) {
        table_.left_out[name] = fmt::format("it repeats {}", it->second.first);
        continue;
      }
    }
    // The topic of a JointState may tell a command or an encoder, a controller's only misleads.
    if (set.type == JointMessageType::kJointState) words.clear();
    table_.columns.push_back({std::move(name), values_of(column), {}, std::move(words)});
  }
}

void JointTable::put_sweep(const JointSet& set, bool is_first) {
  const auto sweep = sweep_of(table_.t_ns, set.t_ns, is_first);
  put(set, [&](const JointColumn& column) {
    std::vector<double> values;
    for (const auto& message : *sweep) values.push_back(message ? column.values[*message] : kLost);
    return values;
  });
}

void JointTable::put_other(const JointSet& set) {
  const std::string who = fmt::format("{} of {}", set.topic, names_of(set.joints));
  const auto& placed = joints_of_topic_[set.topic];
  if (share_joint(placed, set.joints)) {
    table_.left_out[who] =
        fmt::format("{} messages with joints that others of the topic have too", set.t_ns.size());
    left_out_.push_back(who);
    return;
  }
  put(set, [&](const JointColumn& column) {
    return interpolated(set.t_ns, column.values, table_.t_ns);
  });
  interpolated_.push_back(fmt::format("{} ({} messages)", who, set.t_ns.size()));
}

void JointTable::say(const Axis& axis) {
  const JointSet& main = sets_[axis.main];
  const std::size_t repeated =
      std::accumulate(sets_.begin(), sets_.end(), std::size_t{0},
                      [](std::size_t sum, const JointSet& set) { return sum + set.repeated; });
  if (sets_.size() == 1 && repeated == 0) return;
  auto out = std::back_inserter(table_.note);
  fmt::format_to(out, "a row for each of the {} messages of {} with {}", main.t_ns.size(),
                 main.topic, names_of(main.joints));
  if (axis.sets.size() > 1) {
    const std::vector<std::string> joined(
        axis.joints.begin() + static_cast<std::ptrdiff_t>(main.joints.size()), axis.joints.end());
    fmt::format_to(out, "; of the same sweep: {}", names_of(joined));
  }
  if (!interpolated_.empty())
    fmt::format_to(out, "; interpolated at these rows: {}", fmt::join(interpolated_, ", "));
  if (!left_out_.empty()) fmt::format_to(out, "; left out: {}", fmt::join(left_out_, ", "));
  if (const std::size_t columns = table_.left_out.size() - left_out_.size(); columns > 0)
    fmt::format_to(out, "; {} columns that repeat others are left out", columns);
  if (repeated > 0) fmt::format_to(out, "; {} messages repeat a stamp and are left out", repeated);
}

}  // namespace

void fill_joint_table(std::vector<JointSet> sets, record::Table& table) {
  JointTable(std::move(sets), table).fill();
}

}  // namespace ravencal::exchange
