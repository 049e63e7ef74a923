// SPDX-License-Identifier: Apache-2.0
//
// A plant: everything that a simulation needs to know about a robot, as data. Read from a `.toml`
// (load_plant); the schema is explained in shared/FORMATS.md and by the shipped
// tools/plants/*.toml. Units stand in the names. Quantities of a joint are referred to the joint's
// side of the transmission, in rad and N m for a revolute joint, in m and N for a prismatic one
// (`_ji`).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "physics/controller_branch.hpp"

namespace ravencal::physics {

enum class JointKind { kRevolute, kPrismatic };

/// One physical effect of a joint: an id of the vocabulary (effects/effect_spec.hpp) with its
/// parameters, keyed by their names without the unit suffix, in SI units.
struct Effect {
  std::string id;
  std::string from;  ///< coupling, hysteresis: the other joint; compliance: the recorded load
  std::map<std::string, double, std::less<>> parameters;
  std::string posture{};  ///< compliance to a recorded load: the joint on whose position it depends

  bool operator==(const Effect&) const = default;
};

/// What the cable of a joint follows that other joints move: their links, over whose pulleys it
/// runs, or their drives. By virtual work its tension acts on what it follows.
enum class Through { kLink, kDrive };
/// As a plant says it: "link" or "drive".
std::string_view through_word(Through through);

/// Rigid link that the joint moves. Frame: the joint's; of a RAVEN arm after Craig's
/// Denavit-Hartenberg convention.
struct Link {
  double mass_kg = 0.0;
  std::array<double, 3> com_m{};
  std::array<double, 3> inertia_kg_m2{};  ///< principal moments about the centre of mass

  bool operator==(const Link&) const = default;
};

/// Where a joint is, in the frame of the joint that carries it.
struct Frame {
  std::string carried_by;  ///< joint before it; empty: the base
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation{1.0, 0.0, 0.0, 0.0};  ///< unit quaternion, real part first
  std::array<double, 3> axis{0.0, 0.0, 1.0};           ///< unit vector in the joint's own frame

  bool operator==(const Frame&) const = default;
};

/// What the joint may do, as the robot's maker states it: trajectories stay within it. Nothing in a
/// simulation stops a joint there.
struct Limits {
  std::optional<double> low_ji, high_ji;  ///< position
  std::optional<double> speed_ji;         ///< greatest, per second

  bool operator==(const Limits&) const = default;
};

/// What turns a command into motor torque.
struct Drive {
  std::string input = "torque_n_m";  ///< torque_n_m, force_n, voltage_v or current_a
  double gain = 1.0;                 ///< input unit to torque at the gearbox output
  double dac_counts_per_n_m = 0.0;   ///< signed; 0: no DAC between command and drive

  bool operator==(const Drive&) const = default;
};

/// Effort on the joint from outside that a sensor measures: the recorded channel of role `load`,
/// and the effort that balances one unit of it, by sign and lever.
struct ExternalLoad {
  std::string channel;
  double ratio = 1.0;  ///< effort at the joint per unit of the channel

  bool operator==(const ExternalLoad&) const = default;
};

/// The controller's servo: PD on motor position, torque at the gearbox output from motor angle.
struct Controller {
  double kp_n_m_per_rad = 0.0;
  double kd_n_m_s_per_rad = 0.0;
  double dac_limit_counts = 0.0;      ///< command is clipped to this magnitude
  bool gravity_compensation = false;  ///< feed-forward of the links' weight, also where the
                                      ///< controller's branch does not add it

  bool operator==(const Controller&) const = default;
};

/// How the controller and the external encoder find their zeros.
struct Homing {
  double speed_ji = 0.0;              ///< signed: towards the hard stop, per second
  double dac_threshold_counts = 0.0;  ///< the stop counts as reached at this command
  double stop_controller_ji = 0.0;    ///< position that the controller takes the stop for
  double stop_encoder_ji = 0.0;       ///< the same stop as the external encoder's zero defines it
  double stop_stiffness = 0.0;        ///< N m/rad or N/m
  double stop_damping = 0.0;          ///< N m s/rad or N s/m
  double home_ji = 0.0;               ///< where the arm goes after the stop, controller's position

  bool operator==(const Homing&) const = default;
};

/// Of a drive whose plant states no inertia: too small to matter, and not zero.
inline constexpr double kNoInertia_kg_m2 = 1e-12;

struct Joint {
  std::string name;
  JointKind kind = JointKind::kRevolute;
  double motor_inertia_kg_m2 = 0.0;          ///< rotor and gearbox, at the motor shaft
  double gearbox_ratio = 1.0;                ///< motor shaft to gearbox output (capstan)
  double reduction = 1.0;                    ///< motor rad per joint rad, or per m
  double encoder_sign = 1.0;                 ///< sign of the raw motor encoder count
  double joint_encoder_resolution_ji = 0.0;  ///< rad or m per count of the external encoder
  std::optional<Through> coupling_through;   ///< of its row of the coupling; empty: nobody says
  Link link;
  std::optional<Frame> frame{};  ///< all joints have one, or none
  Limits limits{};
  Drive drive;
  std::optional<ExternalLoad> external_load;
  std::optional<Controller> controller;
  std::optional<Homing> homing;
  std::vector<Effect> effects;
  std::map<std::string, double, std::less<>> tolerance;  ///< relative; absent: 0.10

  /// The joint's own effect of that id (not one that comes from elsewhere, but any coupling).
  [[nodiscard]] const Effect* find_effect(std::string_view id) const;
  /// Parameter of an effect; 0 if the joint does not have the effect, or the effect not the value.
  [[nodiscard]] double parameter(std::string_view effect_id, std::string_view name) const;

  bool operator==(const Joint&) const = default;
};

struct Robot {
  std::string name;
  std::string arm;                ///< of a RAVEN-II: "gold" or "green"; empty: another robot
  ControllerBranch controller{};  ///< whose control program runs it
  double control_rate_hz = 1000.0;
  double inner_rate_hz = 10000.0;            ///< integration; a multiple of control_rate_hz
  std::array<double, 3> gravity_m_per_s2{};  ///< in frame 0
  std::array<double, 4> tool_joints_rad{};   ///< roll, wrist, grasp1, grasp2: held
  /// The first homing after that of power-on shifts every motor encoder's value by a draw within
  /// ± this; later ones shift none, and the offsets of tool and void slots stay. 0: no value
  /// shifts, and every homing draws those offsets.
  double rehoming_shift_counts = 0.0;

  bool operator==(const Robot&) const = default;
};

/// A weight fixed to the last link.
struct Payload {
  double mass_kg = 0.0;
  std::array<double, 3> com_m{};

  bool operator==(const Payload&) const = default;
};

struct Sensors {
  double motor_encoder_counts_per_rev = 4000.0;

  bool operator==(const Sensors&) const = default;
};

/// How the recorder pairs the external encoders with the robot's messages (nearest stamp).
struct Logger {
  double rate_hz = 100.0;
  double truth_period_s = 0.01;            ///< between two readings of the external encoders
  double truth_latency_s = 0.0;            ///< from reading to time stamp
  double truth_latency_deviation_s = 0.0;  ///< standard deviation of the latency
  bool given = false;                      ///< the plant has them; else nobody measured them

  bool operator==(const Logger&) const = default;
};

struct Plant {
  Robot robot;
  Payload payload;
  Sensors sensors;
  Logger logger;
  std::vector<Joint> joints;
  std::vector<std::vector<double>>
      coupling;            ///< [joint][joint]: joint = motor/reduction + coupling * joints
  std::string source;      ///< path it was read from, for messages
  std::uint64_t hash = 0;  ///< FNV-1a 64 of the file's bytes
  std::vector<std::string> notes{};  ///< what a foreign model says and no plant can hold

  [[nodiscard]] std::optional<std::size_t> joint_index(std::string_view name) const;

  bool operator==(const Plant&) const = default;
};

/// True if by the plant's coupling other joints move this one.
bool coupled(const Plant& plant, std::size_t joint);

/// True if the joint carries that other joint's link: its own, and where the plant states no frames
/// those after it.
bool carries(const Plant& plant, std::size_t joint, std::size_t link);

/// Reads a plant, or makes one of a robot model (.xml: MJCF, .urdf). Unknown keys and effect ids of
/// a plant are errors: `raven2.toml:41: unknown key 'mas_kg' ...`.
core::Result<Plant> load_plant(const std::filesystem::path& path);

/// The same from text; `source` stands for the path in messages.
core::Result<Plant> parse_plant(std::string_view text, const std::string& source);

/// A plant in words, several lines, for people.
std::string describe_plant(const Plant& plant);
/// The same for programs: joints with their effects, keys as in the file.
std::string describe_plant_in_json(const Plant& plant);

}  // namespace ravencal::physics
