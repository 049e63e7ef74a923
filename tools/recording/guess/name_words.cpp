// SPDX-License-Identifier: Apache-2.0
#include "guess/name_words.hpp"

#include <algorithm>
#include <cctype>

namespace ravencal::guess {
namespace {

using enum Quantity;
using enum Side;

// Words, and pairs of them, of ROS messages, servo tables, robots' interfaces (libfranka, ur_rtde,
// lerobot, dVRK, Dynamixel, ODrive, moteus) and the recordings of robots that are public.
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
    {"theta", kPosition, {}},
    {"jpos", kPosition, {}},
    {"mpos", kPosition, kMotor},
    {"vel", kVelocity, {}},
    {"velocity", kVelocity, {}},
    {"velocities", kVelocity, {}},
    {"speed", kVelocity, {}},
    {"speeds", kVelocity, {}},
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
    {"load", kEffort, {}},
    {"moment", kEffort, {}},
    {"M", kEffort, {}},
    {"current", kDriveSignal, {}},
    {"amps", kDriveSignal, {}},
    {"cur", kDriveSignal, {}},
    {"curr", kDriveSignal, {}},
    {"iq", kDriveSignal, {}},
    {"q current", kDriveSignal, {}},
    {"voltage", kDriveSignal, {}},
    {"duty", kDriveSignal, {}},
    {"pwm", kDriveSignal, {}},
    {"dac", kDriveSignal, {}},
    {"drive", kDriveSignal, {}},
    {"u", kDriveSignal, {}},
    {"temp", kTemperature, {}},
    {"temperature", kTemperature, {}},
    {"acc", kOther, {}},
    {"accel", kOther, {}},
    {"d current", kOther, {}},
    {"input voltage", kOther, {}},
    {"bus voltage", kOther, {}},
    {"dtau", kOther, {}},
    {"qdd", kOther, {}},
    {"ddot", kOther, {}},
    {"tcp", kOther, {}},
    {"pose", kOther, {}},
    {"wrench", kOther, {}},
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
    {"setpoints", {}, kCommand},
    {"action", {}, kCommand},
    {"input", {}, kCommand},
    {"meas", {}, kMeasured},
    {"measured", {}, kMeasured},
    {"actual", {}, kMeasured},
    {"act", {}, kMeasured},
    {"present", {}, kMeasured},
    {"feedback", {}, kMeasured},
    {"estimate", {}, kMeasured},
    {"observation", {}, kMeasured},
    {"state", {}, kMeasured},
    {"enc", {}, kMeasured},
    {"encoder", {}, kMeasured},
    {"motor", {}, kMotor},
    {"rotor", {}, kMotor},
    {"joint encoder", kPosition, kJoint},
    {"link encoder", kPosition, kJoint},
    {"output encoder", kPosition, kJoint},
    {"load encoder", kPosition, kJoint},
    {"q link", kPosition, kJoint},
    {"link pos", kPosition, kJoint},
    {"link position", kPosition, kJoint},
    {"link angle", kPosition, kJoint},
    {"position link", kPosition, kJoint},
    {"pos link", kPosition, kJoint},
    {"link side", {}, kJoint},
    {"joint side", {}, kJoint},
    {"load side", {}, kJoint},
    {"output side", {}, kJoint},
    {"motor side", {}, kMotor},
    {"true", {}, kJoint},
    {"truth", {}, kJoint},
    {"track", {}, kJoint},
    {"tracker", {}, kJoint},
    {"external", {}, kJoint},
    {"ext", {}, kJoint},
};

// Words that name no joint when another is left.
constexpr std::string_view kGeneric[] = {"joint", "joints",   "jnt",   "j",       "dof",
                                         "axis",  "actuator", "servo", "states",  "js",
                                         "data",  "robot",    "hat",   "filtered"};

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
    {"second", "s"},
    {"seconds", "s"},
    {"ms", "ms"},
    {"msec", "ms"},
    {"msecs", "ms"},
    {"millis", "ms"},
    {"milliseconds", "ms"},
    {"us", "us"},
    {"usec", "us"},
    {"usecs", "us"},
    {"micros", "us"},
    {"microseconds", "us"},
    {"ns", "ns"},
    {"nsec", "ns"},
    {"nsecs", "ns"},
    {"nanos", "ns"},
    {"nanosec", "ns"},
    {"nanosecs", "ns"},
    {"nanoseconds", "ns"},
    {"share", "1"},
    {"ratio", "1"},
};

enum class Kind { kNone, kLetter, kDigit };
Kind kind_of(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return std::isalpha(byte) ? Kind::kLetter : std::isdigit(byte) ? Kind::kDigit : Kind::kNone;
}

}  // namespace

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
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

bool names_no_joint(std::string_view word) {
  return std::find(std::begin(kGeneric), std::end(kGeneric), word) != std::end(kGeneric);
}

bool is_number(std::string_view word) {
  return !word.empty() &&
         std::all_of(word.begin(), word.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// "sec", "micros": longer than a symbol, so that it names a column.
bool is_word_of_time(const Spelling& spelling) {
  return spelling.words.size() > 2 && spelling.unit.ends_with('s') && spelling.unit.size() <= 2;
}

UnitWord take_unit(std::vector<std::string>& words) {
  const Spelling* best = nullptr;
  std::size_t taken = 0;
  for (std::size_t count = 1; count <= 3 && count <= words.size(); ++count) {
    std::string end;
    for (std::size_t i = words.size() - count; i < words.size(); ++i)
      end += (end.empty() ? "" : " ") + words[i];
    for (const Spelling& spelling : kSpellings) {
      // A name of one word is a unit where no joint and no axis is called so.
      if (spelling.words != end || (count == words.size() && !is_word_of_time(spelling))) continue;
      best = &spelling;
      taken = count;
    }
  }
  if (best == nullptr) return {};
  words.resize(words.size() - taken);
  return {best->unit, best->scale};
}

}  // namespace ravencal::guess
