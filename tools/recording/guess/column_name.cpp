// SPDX-License-Identifier: Apache-2.0
#include "guess/column_name.hpp"

#include <algorithm>
#include <array>

#include "core/units.hpp"
#include "guess/name_words.hpp"

namespace ravencal::guess {
namespace {

using enum Quantity;
using enum Side;

/// The two words that a word is written of ("qcmd"), the second of at least three letters.
std::optional<std::array<const Word*, 2>> halves_of(std::string_view text) {
  for (std::size_t at = 1; at + 3 <= text.size(); ++at) {
    const Word* first = find_word(text.substr(0, at));
    const Word* second = find_word(text.substr(at));
    if (first != nullptr && second != nullptr) return std::array{first, second};
  }
  return std::nullopt;
}

std::optional<Quantity> quantity_of_unit(std::string_view unit) {
  if (unit == "V" || unit == "A" || unit == "dac_counts") return kDriveSignal;
  if (unit == "degC") return kTemperature;
  const auto known = core::find_unit(unit);
  if (!known) return std::nullopt;
  if (known->si_name == "s") return kTime;
  if (known->si_name == "rad_per_s" || known->si_name == "m_per_s") return kVelocity;
  if (known->si_name == "N_m" || known->si_name == "N") return kEffort;
  if (known->si_name == "rad" || known->si_name == "m") return kPosition;
  return std::nullopt;
}

/// True if the joint has a name of its own, and not a number alone, which may count from 0 in one
/// file and from 1 in another.
bool has_own_word(const std::vector<std::string>& joint) {
  return std::any_of(joint.begin(), joint.end(), [](const std::string& word) {
    return !is_number(word) && !names_no_joint(word) && find_word(word) == nullptr;
  });
}

std::vector<std::string> lower_words_of(std::string_view name) {
  std::vector<std::string> words = words_of(name);
  for (std::string& word : words) word = lower(word);
  return words;
}

/// Takes the words of the joint's name out, of the longest one where several are there.
void take_joint(std::vector<std::string>& words, const std::vector<std::string>& joints,
                ColumnName& out) {
  std::vector<std::string> text;
  for (const std::string& word : words) text.push_back(lower(word));
  std::size_t at = 0, count = 0;
  for (const std::string& joint : joints) {
    const std::vector<std::string> name = lower_words_of(joint);
    if (name.size() <= count || !has_own_word(name)) continue;
    const auto found = std::search(text.begin(), text.end(), name.begin(), name.end());
    if (found == text.end()) continue;
    at = static_cast<std::size_t>(found - text.begin());
    count = name.size();
    out.joint = joint;
  }
  out.names_joint = count > 0;
  const auto first = words.begin() + static_cast<std::ptrdiff_t>(at);
  words.erase(first, first + static_cast<std::ptrdiff_t>(count));
}

/// What the words say, one after the other; numbers between them do not part them.
class Reading {
 public:
  explicit Reading(ColumnName& out) : out_(out) {}

  /// True if the word says something.
  bool take(const std::string& word) {
    const std::string text = lower(word);
    if (text == "dot" && out_.quantity) {
      out_.quantity = *out_.quantity == kPosition ? kVelocity : kOther;
      return true;
    }
    if (text == "d" && last_ != nullptr && last_->quantity) return take_d();
    if (text == "qd") return out_.is_desired_or_derivative = true;
    if (const Word* known = word == "M" ? find_word(word) : find_word(text); known != nullptr) {
      add(*known);
      return true;
    }
    const auto halves = halves_of(text);
    if (!halves) return false;
    for (const Word* half : *halves) add(*half);
    return true;
  }

  void add(const Word& word) {
    // Of two words that both name a quantity, "drive_torque" is a torque.
    if (word.quantity &&
        (!out_.quantity || *out_.quantity == kDriveSignal || *word.quantity == kOther))
      out_.quantity = word.quantity;
    if (word.side && !out_.side) out_.side = word.side;
    last_ = &word;
  }

 private:
  /// "q_d" is desired or a derivative, "dq_d" and "tau_J_d" are desired.
  bool take_d() {
    if (last_->text == "q" || last_->text == "theta") {
      out_.quantity.reset();
      out_.is_desired_or_derivative = true;
    } else {
      out_.side = kCommand;
    }
    return true;
  }

  ColumnName& out_;
  const Word* last_ = nullptr;
};

/// The words that are left; those that tell no joint only where there is no other.
std::string joint_of(const std::vector<std::string>& left) {
  const bool specific =
      std::any_of(left.begin(), left.end(), [](const auto& word) { return !names_no_joint(word); });
  std::string joint;
  for (const std::string& word : left) {
    if (specific && names_no_joint(word)) continue;
    joint += (joint.empty() ? "" : "_") + word;
  }
  return joint;
}

}  // namespace

ColumnName read_column_name(std::string_view name, const std::vector<std::string>& joints) {
  ColumnName out;
  std::vector<std::string> words = words_of(name);
  const UnitWord unit = take_unit(words);
  out.unit = unit.unit;
  out.scale = unit.scale;
  take_joint(words, joints, out);
  std::vector<std::string> left;
  Reading reading(out);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const Word* pair =
        i + 1 < words.size() ? find_word(lower(words[i]) + " " + lower(words[i + 1])) : nullptr;
    if (pair != nullptr) {
      reading.add(*pair);
      ++i;
    } else if (!reading.take(words[i])) {
      left.push_back(lower(words[i]));
    }
  }
  if (!out.quantity && !out.is_desired_or_derivative) out.quantity = quantity_of_unit(out.unit);
  // What a sensor or an observer says of the surroundings is no effort of the drive.
  if (out.quantity == kEffort && out.side == kJoint) out.quantity = kOther;
  if (!out.names_joint) out.joint = joint_of(left);
  return out;
}

}  // namespace ravencal::guess
