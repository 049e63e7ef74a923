// SPDX-License-Identifier: Apache-2.0
#include "guess/column_name.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include "core/units.hpp"

namespace ravencal::guess {
namespace {

using enum Quantity;
using enum Side;

struct Word {
  std::string_view text;
  std::optional<Quantity> quantity;
  std::optional<Side> side;
};

// Words of ROS messages, servo tables and the recordings of robots that are public.
constexpr Word kWords[] = {
    {"time", kTime, {}},
    {"stamp", kTime, {}},
    {"timestamp", kTime, {}},
    {"t", kTime, {}},
    {"pos", kPosition, {}},
    {"position", kPosition, {}},
    {"positions", kPosition, {}},
    {"angle", kPosition, {}},
    {"angles", kPosition, {}},
    {"q", kPosition, {}},
    {"qpos", kPosition, {}},
    {"qd", {}, {}},  // desired or derivative: the values tell       {"theta", kPosition, {}},
    {"jpos", kPosition, {}},
    {"mpos", kPosition, kMotor},
    {"vel", kVelocity, {}},
    {"velocity", kVelocity, {}},
    {"velocities", kVelocity, {}},
    {"speed", kVelocity, {}},
    {"omega", kVelocity, {}},
    {"dq", kVelocity, {}},
    {"qdot", kVelocity, {}},
    {"qvel", kVelocity, {}},
    {"jvel", kVelocity, {}},
    {"mvel", kVelocity, kMotor},
    {"effort", kEffort, {}},
    {"efforts", kEffort, {}},
    {"eff", kEffort, {}},
    {"torque", kEffort, {}},
    {"torques", kEffort, {}},
    {"tau", kEffort, {}},
    {"trq", kEffort, {}},
    {"force", kEffort, {}},
    {"current", kDriveSignal, {}},
    {"amps", kDriveSignal, {}},
    {"voltage", kDriveSignal, {}},
    {"duty", kDriveSignal, {}},
    {"pwm", kDriveSignal, {}},
    {"dac", kDriveSignal, {}},
    {"drive", kDriveSignal, {}},
    {"u", kDriveSignal, {}},
    {"temp", kTemperature, {}},
    {"temperature", kTemperature, {}},
    {"acc", kOther, {}},
    {"acceleration", kOther, {}},
    {"ddq", kOther, {}},
    {"qacc", kOther, {}},
    {"supply", kOther, {}},
    {"std", kOther, {}},
    {"stddev", kOther, {}},
    {"var", kOther, {}},
    {"variance", kOther, {}},
    {"error", kOther, {}},
    {"cmd", {}, kCommand},
    {"command", {}, kCommand},
    {"commands", {}, kCommand},
    {"commanded", {}, kCommand},
    {"goal", {}, kCommand},
    {"target", {}, kCommand},
    {"ref", {}, kCommand},
    {"reference", {}, kCommand},
    {"des", {}, kCommand},
    {"desired", {}, kCommand},
    {"setpoint", {}, kCommand},
    {"meas", {}, kMeasured},
    {"measured", {}, kMeasured},
    {"actual", {}, kMeasured},
    {"act", {}, kMeasured},
    {"present", {}, kMeasured},
    {"state", {}, kMeasured},
    {"enc", {}, kMeasured},
    {"encoder", {}, kMeasured},
    {"motor", {}, kMotor},
    {"rotor", {}, kMotor},
    {"true", {}, kJoint},
    {"truth", {}, kJoint},
    {"track", {}, kJoint},
    {"tracker", {}, kJoint},
    {"external", {}, kJoint},
    {"ext", {}, kJoint},
};

// Words that name no joint when another is left.
constexpr std::string_view kGeneric[] = {"joint", "joints", "states", "axis",
                                         "js",    "data",   "robot"};

struct Spelling {
  std::string_view words;  ///< as they stand in names, separators taken for spaces
  std::string_view unit;
  double scale = 1.0;
};
constexpr Spelling kSpellings[] = {
    {"rad per s", "rad_per_s"},
    {"rad s", "rad_per_s"},
    {"radps", "rad_per_s"},
    {"deg per s", "deg_per_s"},
    {"deg s", "deg_per_s"},
    {"dps", "deg_per_s"},
    {"degps", "deg_per_s"},
    {"m per s", "m_per_s"},
    {"m s", "m_per_s"},
    {"mm per s", "mm_per_s"},
    {"mm s", "mm_per_s"},
    {"rpm", "deg_per_s", 6.0},
    {"Nm", "N_m"},
    {"N m", "N_m"},
    {"nm", "N_m"},
    {"mNm", "mN_m"},
    {"m Nm", "mN_m"},
    {"mN m", "mN_m"},
    {"N", "N"},
    {"rad", "rad"},
    {"rads", "rad"},
    {"mrad", "mrad"},
    {"deg", "deg"},
    {"degree", "deg"},
    {"degrees", "deg"},
    {"m", "m"},
    {"cm", "cm"},
    {"mm", "mm"},
    {"um", "um"},
    {"V", "V"},
    {"mV", "V", 1e-3},
    {"A", "A"},
    {"mA", "A", 1e-3},
    {"m A", "A", 1e-3},
    {"C", "degC"},
    {"degC", "degC"},
    {"counts", "counts"},
    {"ticks", "counts"},
    {"raw", "counts"},
    {"s", "s"},
    {"sec", "s"},
    {"secs", "s"},
    {"seconds", "s"},
    {"ms", "ms"},
    {"us", "us"},
    {"ns", "ns"},
    {"share", "1"},
    {"ratio", "1"},
};

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

enum class Kind { kNone, kLetter, kDigit };
Kind kind_of(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return std::isalpha(byte) ? Kind::kLetter : std::isdigit(byte) ? Kind::kDigit : Kind::kNone;
}

std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  Kind last = Kind::kNone;
  for (const char c : name) {
    const Kind kind = kind_of(c);
    const bool hump = kind == Kind::kLetter && last == Kind::kLetter &&
                      std::isupper(static_cast<unsigned char>(c)) &&
                      std::islower(static_cast<unsigned char>(words.back().back())) &&
                      words.back().size() > 1;
    if (kind != Kind::kNone && (kind != last || hump)) words.emplace_back();
    if (kind != Kind::kNone) words.back() += c;
    last = kind;
  }
  return words;
}

const Word* find_word(std::string_view text) {
  const auto it = std::find_if(std::begin(kWords), std::end(kWords),
                               [&](const Word& word) { return word.text == text; });
  return it == std::end(kWords) ? nullptr : it;
}

/// The two words that a word is written of ("qcmd"), the second of at least three letters.
std::optional<std::array<const Word*, 2>> halves_of(std::string_view text) {
  for (std::size_t at = 1; at + 3 <= text.size(); ++at) {
    const Word* first = find_word(text.substr(0, at));
    const Word* second = find_word(text.substr(at));
    if (first != nullptr && second != nullptr) return std::array{first, second};
  }
  return std::nullopt;
}

/// Takes the longest spelling of a unit off the end; the first word names no unit.
void take_unit(std::vector<std::string>& words, ColumnName& out) {
  const Spelling* best = nullptr;
  std::size_t taken = 0;
  for (std::size_t count = 1; count <= 3 && count < words.size(); ++count) {
    std::string end;
    for (std::size_t i = words.size() - count; i < words.size(); ++i)
      end += (end.empty() ? "" : " ") + words[i];
    for (const Spelling& spelling : kSpellings) {
      if (spelling.words != end) continue;
      best = &spelling;
      taken = count;
    }
  }
  if (best == nullptr) return;
  out.unit = best->unit;
  out.scale = best->scale;
  words.resize(words.size() - taken);
}

std::optional<Quantity> quantity_of_unit(std::string_view unit) {
  if (unit == "V" || unit == "A" || unit == "dac_counts") return kDriveSignal;
  if (unit == "degC") return kTemperature;
  const auto known = core::find_unit(unit);
  if (!known) return std::nullopt;
  if (known->si_name == "rad_per_s" || known->si_name == "m_per_s") return kVelocity;
  if (known->si_name == "N_m" || known->si_name == "N") return kEffort;
  if (known->si_name == "rad" || known->si_name == "m") return kPosition;
  return std::nullopt;
}

/// Quantity of two words that both name one: "drive_torque" is a torque, "present_current" a
/// signal.
void add_word(const Word& word, ColumnName& out) {
  if (word.quantity && (!out.quantity || *out.quantity == kDriveSignal || *word.quantity == kOther))
    out.quantity = word.quantity;
  if (word.side && !out.side) out.side = word.side;
}

}  // namespace

ColumnName read_column_name(std::string_view name) {
  ColumnName out;
  std::vector<std::string> words = words_of(name);
  take_unit(words, out);
  std::vector<std::string> left;
  for (const std::string& word : words) {
    const std::string text = lower(word);
    if (const Word* known = find_word(text); known != nullptr) {
      add_word(*known, out);
    } else if (const auto halves = halves_of(text)) {
      for (const Word* half : *halves) add_word(*half, out);
    } else {
      left.push_back(text);
    }
  }
  if (!out.quantity) out.quantity = quantity_of_unit(out.unit);
  const bool specific = std::any_of(left.begin(), left.end(), [](const std::string& word) {
    return std::find(std::begin(kGeneric), std::end(kGeneric), word) == std::end(kGeneric);
  });
  for (const std::string& word : left) {
    const bool generic =
        std::find(std::begin(kGeneric), std::end(kGeneric), word) != std::end(kGeneric);
    if (generic && specific) continue;
    out.joint += (out.joint.empty() ? "" : "_") + word;
  }
  return out;
}

}  // namespace ravencal::guess
