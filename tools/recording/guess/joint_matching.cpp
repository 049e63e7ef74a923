// SPDX-License-Identifier: Apache-2.0
#include "guess/joint_matching.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>

#include "guess/name_words.hpp"

namespace ravencal::guess {
namespace {

/// The words of a key or a joint, and the number that ends them.
struct Words {
  std::string text;  ///< all of them, without separators
  std::set<std::string> words;
  std::optional<unsigned> number;
};

Words split(const std::string& name) {
  Words out;
  for (const std::string& word : words_of(read_column_name(name).joint)) {
    out.text += word;
    out.number.reset();
    if (!is_number(word)) {
      out.words.insert(word);
      continue;
    }
    unsigned number = 0;
    if (std::from_chars(word.data(), word.data() + word.size(), number).ec == std::errc())
      out.number = number;
  }
  return out;
}

class Matching {
 public:
  Matching(const std::vector<std::string>& keys, const std::vector<std::string>& joints)
      : keys_(keys),
        joints_(joints),
        joint_of_(keys.size()),
        is_taken_(joints.size(), false),
        is_guess_(keys.size(), false) {
    for (const std::string& key : keys) of_keys_.push_back(split(key));
    for (const std::string& joint : joints) of_joints_.push_back(split(joint));
    take_equal();
    take_numbered();
    take_alike();
    take_in_order();
  }

  [[nodiscard]] JointMatches matches() const {
    JointMatches out;
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      if (!joint_of_[k])
        out.missing.push_back(shown(k));
      else
        out.joint_of_key[keys_[k]] = joints_[*joint_of_[k]];
      if (!is_guess_[k]) continue;
      out.guessed_keys.insert(keys_[k]);
      out.guessed.push_back(fmt::format("{} = {}", shown(k), joints_[*joint_of_[k]]));
    }
    for (std::size_t j = 0; j < joints_.size(); ++j)
      if (!is_taken_[j]) out.free_joints.push_back(joints_[j]);
    return out;
  }

 private:
  [[nodiscard]] std::string shown(std::size_t k) const {
    return keys_[k].empty() ? "no word" : keys_[k];
  }
  void take(std::size_t k, std::size_t j, bool is_guess) {
    joint_of_[k] = j;
    is_taken_[j] = true;
    is_guess_[k] = is_guess;
  }
  [[nodiscard]] std::vector<std::size_t> open_keys() const {
    std::vector<std::size_t> open;
    for (std::size_t k = 0; k < keys_.size(); ++k)
      if (!joint_of_[k]) open.push_back(k);
    return open;
  }

  /// Names with a word of their own. A number alone is no name: it may count from 0.
  void take_equal() {
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      for (std::size_t j = 0; j < joints_.size() && !joint_of_[k]; ++j) {
        if (!is_taken_[j] && !of_keys_[k].words.empty() && of_keys_[k].text == of_joints_[j].text)
          take(k, j, false);
      }
    }
  }

  /// Keys that share their words and differ in their numbers, where no joint has such a word.
  void take_numbered() {
    std::vector<std::size_t> numbered;
    for (const std::size_t k : open_keys()) {
      if (of_keys_[k].number && !knows_a_word_of(k)) numbered.push_back(k);
    }
    if (numbered.empty() || !same_words(numbered)) return;
    if (take_by_number(numbered)) return;
    std::sort(numbered.begin(), numbered.end(), [this](std::size_t a, std::size_t b) {
      return *of_keys_[a].number < *of_keys_[b].number;
    });
    const unsigned lowest = *of_keys_[numbered.front()].number;
    const unsigned highest = *of_keys_[numbered.back()].number;
    // Numbers from 0 or 1 on count the joints; other numbers do where all joints are there.
    const bool counts = lowest <= 1 && highest - lowest < joints_.size();
    if (!counts && numbered.size() != joints_.size()) return;
    for (std::size_t i = 0; i < numbered.size(); ++i) {
      const std::size_t joint = counts ? *of_keys_[numbered[i]].number - lowest : i;
      if (!is_taken_[joint]) take(numbered[i], joint, true);
    }
  }
  [[nodiscard]] bool knows_a_word_of(std::size_t k) const {
    return std::any_of(of_joints_.begin(), of_joints_.end(),
                       [&](const Words& joint) { return in_common(of_keys_[k], joint) > 0; });
  }
  [[nodiscard]] bool same_words(const std::vector<std::size_t>& keys) const {
    return std::all_of(keys.begin(), keys.end(), [&](std::size_t k) {
      return of_keys_[k].words == of_keys_[keys.front()].words;
    });
  }
  /// True where each of these numbers is that of one of the joints that only their numbers tell
  /// apart, which most are.
  bool take_by_number(const std::vector<std::size_t>& numbered) {
    std::map<unsigned, std::size_t> series;
    for (const Words& of_series : of_joints_) {
      series.clear();
      for (std::size_t j = 0; j < joints_.size(); ++j) {
        const Words& joint = of_joints_[j];
        if (joint.number && joint.words == of_series.words && !is_taken_[j])
          series[*joint.number] = j;
      }
      if (2 * series.size() > joints_.size()) break;
      series.clear();
    }
    for (const std::size_t k : numbered)
      if (!series.contains(*of_keys_[k].number)) return false;
    for (const std::size_t k : numbered)
      take(k, series.at(*of_keys_[k].number), !of_keys_[k].words.empty());
    return true;
  }

  static std::size_t in_common(const Words& a, const Words& b) {
    return static_cast<std::size_t>(
        std::count_if(a.words.begin(), a.words.end(),
                      [&](const std::string& word) { return b.words.contains(word); }));
  }
  /// 1: the same words; 0: none in common, or another number.
  static double likeness(const Words& a, const Words& b) {
    if (a.number && b.number && a.number != b.number) return 0.0;
    const std::size_t all = std::max(a.words.size(), b.words.size());
    return all == 0 ? 0.0 : static_cast<double>(in_common(a, b)) / static_cast<double>(all);
  }

  /// The most alike first; a key that two joints are equally like is left.
  void take_alike() {
    while (true) {
      double best = 0.0;
      std::optional<std::pair<std::size_t, std::size_t>> pair;
      for (const std::size_t k : open_keys()) {
        std::optional<std::size_t> joint;
        double most = 0.0;
        for (std::size_t j = 0; j < joints_.size(); ++j) {
          const double here = is_taken_[j] ? 0.0 : likeness(of_keys_[k], of_joints_[j]);
          if (here < most || here == 0.0) continue;
          joint = here > most ? std::optional(j) : std::nullopt;
          most = here;
        }
        if (joint && most > best) best = most, pair = {k, *joint};
      }
      if (!pair) return;
      take(pair->first, pair->second, true);
    }
  }

  /// Between two joints that are known, where as many keys as joints are open.
  void take_in_order() {
    std::size_t key = 0, joint = 0;
    for (std::size_t k = 0; k <= keys_.size(); ++k) {
      const bool at_end = k == keys_.size();
      if (!at_end && !joint_of_[k]) continue;
      const std::size_t next = at_end ? joints_.size() : *joint_of_[k];
      if (next < joint) return;  // the file has another order
      if (k - key == next - joint) {
        for (; key < k; ++key, ++joint)
          if (!is_taken_[joint]) take(key, joint, true);
      }
      key = k + 1;
      joint = next + 1;
    }
  }

  const std::vector<std::string>& keys_;
  const std::vector<std::string>& joints_;
  std::vector<Words> of_keys_, of_joints_;
  std::vector<std::optional<std::size_t>> joint_of_;  ///< of each key
  std::vector<bool> is_taken_;
  std::vector<bool> is_guess_;  ///< of each key
};

}  // namespace

JointMatches match_joints(const std::vector<std::string>& keys,
                          const std::vector<std::string>& joints) {
  return Matching(keys, joints).matches();
}

}  // namespace ravencal::guess
