/* SPDX-License-Identifier: Apache-2.0
 *
 * ravencal plugin: corrected joints 1-3 of a cable-driven arm, inside the robot's control loop.
 * Plain C90, so that any controller can include it. rt_plugin/ABI.md is the contract in words.
 *
 * Thread tags:  [init] not from the real-time thread, not concurrently with [rt] calls unless said;
 *               [rt]   real-time safe: bounded time, no allocation, lock, system call or exception;
 *                      one thread at a time per instance;
 *               [any]  any thread at any time.
 * Units: SI (rad, m, N.m, s) except where the name says otherwise; the insertion is m. Joint arrays
 * have the controller's 8 slots: shoulder, elbow, insertion, void, roll, wrist, grasp1, grasp2.
 */
#ifndef RAVENCAL_PLUGIN_H
#define RAVENCAL_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RAVENCAL_ABI_MAJOR 3 /* anything but an appended field or function */
#define RAVENCAL_ABI_MINOR 3 /* appended fields and functions */

#define RAVENCAL_SLOTS 8
#define RAVENCAL_JOINTS 3 /* shoulder, elbow, insertion */

/* What the plugin did this tick. */
#define RAVENCAL_OK 0     /* correction (possibly fading in) applied */
#define RAVENCAL_HELD 1   /* on a doubt: the correction is held, fading, or its constant part */
#define RAVENCAL_BYPASS 2 /* the robot's own value, unchanged */
#define RAVENCAL_FAULT 3  /* the robot's own value, latched until reset */

/* Results of [init] functions. Negative: refused. */
#define RAVENCAL_SUCCESS 0
#define RAVENCAL_ERROR_ARGUMENT (-1)  /* null pointer, wrong struct_size, value out of range */
#define RAVENCAL_ERROR_IO (-2)        /* the file cannot be opened or read */
#define RAVENCAL_ERROR_BLOB (-3)      /* the file is not a valid blob; see last_error */
#define RAVENCAL_ERROR_TOPOLOGY (-4)  /* the blob corrects more joints than there are */
#define RAVENCAL_ERROR_FEATURES (-5)  /* the blob asks for features that no robot state has */
#define RAVENCAL_ERROR_SELF_TEST (-6) /* the network does not reproduce the blob's test vectors */
#define RAVENCAL_ERROR_MEMORY (-7)    /* storage too small, or memory cannot be had */
#define RAVENCAL_ERROR_TRUST (-8)     /* others may write the blob; signature missing or wrong */
#define RAVENCAL_ERROR_BUSY (-9)    /* telemetry_name has another live writer, or is no telemetry */
#define RAVENCAL_ERROR_ORIGIN (-10) /* weights of another or no arm, or corrected joints */
#define RAVENCAL_ERROR_LIMIT (-11)  /* a limit of the process: open files, size of files */

/* States of the envelope. */
#define RAVENCAL_STATE_OFF 0
#define RAVENCAL_STATE_ARMED 1 /* enabled, waiting for a homed, healthy robot */
#define RAVENCAL_STATE_FADING_IN 2
#define RAVENCAL_STATE_ACTIVE 3
#define RAVENCAL_STATE_HOLD 4 /* a doubt: stays, while the pedal is down or for hold_ns at most */
/* On the way to CONSTANT, ARMED, OFF or FAULT; waits while the pedal is down. */
#define RAVENCAL_STATE_FADING_OUT 5
/* A lasting doubt: only the constant part of the correction; the rest returns after the doubt. */
#define RAVENCAL_STATE_CONSTANT 6
#define RAVENCAL_STATE_FAULT 7
#define RAVENCAL_STATE_SHADOW 8 /* nothing is applied; would_be_ji shows what would be */
#define RAVENCAL_STATE_COUNT 9
#define RAVENCAL_STATE_CAPACITY 16 /* room in the counter block */

/* What the operator asks for, since 3.2. */
#define RAVENCAL_MODE_OFF 0
#define RAVENCAL_MODE_ARM 1
#define RAVENCAL_MODE_SHADOW 2

/* Why a correction is not applied in full: bits of ravencal_output.doubts. */
#define RAVENCAL_DOUBT_ROBOT_STATE 1u   /* run level or joints not ready */
#define RAVENCAL_DOUBT_NO_WEIGHTS 2u    /* nothing loaded yet */
#define RAVENCAL_DOUBT_TIME 4u          /* time stood still, ran back or jumped */
#define RAVENCAL_DOUBT_NOT_LATCHED 8u   /* observe_cycle_end was not called in the last cycle */
#define RAVENCAL_DOUBT_NOT_FINITE 16u   /* an input was NaN or infinite */
#define RAVENCAL_DOUBT_OUT_OF_RANGE 32u /* an input far outside the trained range */
#define RAVENCAL_DOUBT_WARMING_UP 64u   /* fewer cycles seen than the oldest input of the network */
#define RAVENCAL_DOUBT_MAGNITUDE 128u   /* the network asks for more than max_correction_ji */
#define RAVENCAL_DOUBT_NETWORK 256u     /* finite inputs, but the result is not: FAULT */
#define RAVENCAL_DOUBT_ENCODER_JUMP 512u /* counts changed by more than max_encoder_step_counts */
#define RAVENCAL_DOUBT_DISTANCE 1024u    /* inputs jointly unlike the training set */
#define RAVENCAL_DOUBT_OVERRUN 2048u     /* too many steps above step_budget_ns: until reset */
#define RAVENCAL_DOUBT_PEDAL 4096u       /* the pedal moved less than 20 ms ago */
#define RAVENCAL_DOUBT_LIMIT 8192u       /* a correction or a command ended at a limit */
#define RAVENCAL_DOUBT_PRESS 16384u /* this press's desired joints held less of the correction */
#define RAVENCAL_DOUBT_KINDS 15
#define RAVENCAL_DOUBT_CAPACITY 32 /* room in the counter block */

/* Instruction sets, for config.max_isa and info. */
#define RAVENCAL_ISA_BEST 0u /* the best that the processor has */
#define RAVENCAL_ISA_BASELINE 1u
#define RAVENCAL_ISA_AVX2 2u
#define RAVENCAL_ISA_AVX512 3u
#define RAVENCAL_ISA_AVX512_VNNI 4u /* as AVX512, with its 8-bit dot product */
#define RAVENCAL_ISA_NEON 5u        /* the only one on aarch64 */

/* Arms of the robot, for config.arm and info. */
#define RAVENCAL_ARM_ANY 0u   /* config: weights of any arm; info: the weights do not say */
#define RAVENCAL_ARM_GOLD 1u  /* left */
#define RAVENCAL_ARM_GREEN 2u /* right */

/* Coordinates of the recordings that weights were trained on, for info. */
#define RAVENCAL_COORDINATES_UNKNOWN 0u
#define RAVENCAL_COORDINATES_MOTOR 1u     /* joints as the motors give them, without a correction */
#define RAVENCAL_COORDINATES_CORRECTED 2u /* recorded with a correction: refused by load */

/* Precision of the weights, for info. */
#define RAVENCAL_PRECISION_F32 0u
#define RAVENCAL_PRECISION_BF16 1u
#define RAVENCAL_PRECISION_INT8 2u

/* One arm, as the controller holds it. */
typedef struct ravencal_arm {
  int32_t type;      /* USB serial or arm id, as raven_state publishes it */
  int32_t pos_um[3]; /* end effector, micrometres */
  int32_t pos_d_um[3];
  float ori[9]; /* rotation, row-major */
  float ori_d[9];
  int32_t enc_counts[RAVENCAL_SLOTS]; /* raw motor encoder counts */
  int32_t enc_offset_counts[RAVENCAL_SLOTS];
  int32_t dac_counts[RAVENCAL_SLOTS]; /* commanded current, after clipping */
  float tau_n_m[RAVENCAL_SLOTS];      /* commanded torque at the capstan */
  float mpos_rad[RAVENCAL_SLOTS];     /* motor angle */
  float mpos_d_rad[RAVENCAL_SLOTS];
  float mvel_rad_per_s[RAVENCAL_SLOTS];
  float jpos_ji[RAVENCAL_SLOTS]; /* joint, rad; insertion m */
  float jpos_d_ji[RAVENCAL_SLOTS];
  float jvel_ji[RAVENCAL_SLOTS]; /* rad/s; insertion m/s */
  float grasp_d_rad;
  float jac_vel[6];
  float jac_f[6];
  uint32_t joints_ready; /* bit i: joint slot i is homed (jstate_ready) */
} ravencal_arm;

/* Robot state of one control cycle. arm[0] is the calibrated arm, arm[1] the other one: the host
 * maps them from its configuration, never from slot order. */
typedef struct ravencal_state {
  uint32_t struct_size; /* sizeof(ravencal_state) of the host */
  int32_t runlevel;     /* 0 E-stop, 1 init, 2 pedal up, 3 pedal down */
  int32_t sublevel;
  int32_t last_seq;
  int64_t t_ns; /* monotonic time of this cycle */
  ravencal_arm arm[2];
} ravencal_state;

/* Result of one step. */
typedef struct ravencal_output {
  uint32_t struct_size;                 /* set by the host: sizeof(ravencal_output) */
  int32_t state;                        /* RAVENCAL_STATE_* */
  float jpos_ji[RAVENCAL_JOINTS];       /* corrected joints, else the input */
  float correction_ji[RAVENCAL_JOINTS]; /* what was added */
  float predicted_ji[RAVENCAL_JOINTS];  /* what the network asked for, before fading and limits */
  uint32_t doubts;                      /* RAVENCAL_DOUBT_* of this cycle */
  float confidence;                     /* 0..1: how like the training set the inputs are */
  uint32_t step_ns;                     /* what this step took, measured by itself */
  float offset_ji[RAVENCAL_JOINTS];     /* correction minus the wanted one: pedal down */
  /* Since 3.1. Where the host has to put jpos_d of arm[0]: where the state had it, moved by the
   * change of the correction while the motors do not follow. */
  float desired_ji[RAVENCAL_JOINTS];
  /* Since 3.2. What would be added in SHADOW, and in which state; else correction_ji and state. */
  float would_be_ji[RAVENCAL_JOINTS];
  int32_t would_be_state;
} ravencal_output;

/* Settings; fill with default_config first. */
typedef struct ravencal_config {
  uint32_t struct_size;
  uint32_t tick_ns; /* control period; 1 000 000 */
  /* Fastest fade; the pedal is up in every fade. In INIT and at a limit there is none. */
  float slew_ji_per_s[RAVENCAL_JOINTS];
  float max_correction_ji[RAVENCAL_JOINTS];            /* larger predictions are refused */
  float max_correction_rate_ji_per_s[RAVENCAL_JOINTS]; /* rate limit in normal work */
  uint32_t max_isa;                 /* RAVENCAL_ISA_*: do not go beyond this one */
  uint32_t hold_ns;                 /* longest HOLD with the pedal up; 20 000 000; 0: none */
  uint32_t step_budget_ns;          /* longer steps are overruns; 500 000; 0: no limit */
  uint32_t max_overruns;            /* 1..64 in 1000 steps: CONSTANT until reset; 3 */
  uint32_t max_encoder_step_counts; /* largest change of a count per tick; 512; 0: no limit */
  uint32_t require_signature;       /* 1: only blobs signed by the key below */
  uint8_t public_key[32];           /* Ed25519 */
  char telemetry_name[64];          /* POSIX shared memory ("/ravencal-left") or "" */
  uint32_t arm;                     /* RAVENCAL_ARM_*: whose weights are taken */
  float follow_share;               /* pedal down: of the commanded motion of a joint; 0..1; 0.1 */
  float blend_share; /* the same of an offset that shrinks (0.1), and by at most this rate: */
  float blend_ji_per_s[RAVENCAL_JOINTS];
  /* Since 3.1. Limits at which the controller's inverse kinematics saturate joints 1 to 3; none. */
  float lowest_ji[RAVENCAL_JOINTS];
  float highest_ji[RAVENCAL_JOINTS];
  /* Insertion with the wrist in the remote centre; inverse kinematics fail within the radius. */
  float remote_centre_m;
  float remote_centre_radius_m;
  /* Since 3.2. After an emergency stop: 0: SHADOW; 1: the mode of before, as hosts of 3.1 have. */
  uint32_t resume_after_stop;
  uint32_t joint_mask;  /* bit j: joint j is corrected; 7 */
  float share;          /* 0..1 of what the weights ask for; 1 */
  float cap_deviations; /* largest: the training's mean error and so many deviations; 4; 0: any */
} ravencal_config;

/* One change of the envelope's state. */
typedef struct ravencal_transition {
  uint64_t tick; /* value of counters.ticks when it happened */
  int64_t t_ns;  /* ravencal_state.t_ns of that cycle */
  int32_t from;  /* RAVENCAL_STATE_* */
  int32_t to;
  uint32_t doubts; /* RAVENCAL_DOUBT_*: the reason; 0: enable, reset or the end of a fade */
  uint32_t reserved;
} ravencal_transition;

#define RAVENCAL_TRANSITIONS_KEPT 16

/* Everything that happened, for a host to show. Copied whole by `counters`. */
typedef struct ravencal_counters {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t ticks;
  uint64_t ticks_in_state[RAVENCAL_STATE_CAPACITY];
  uint64_t ticks_in_doubt[RAVENCAL_DOUBT_CAPACITY]; /* in the order of the RAVENCAL_DOUBT_* bits */
  uint64_t clamped_inputs;                          /* inputs clamped to near their trained range */
  uint64_t limited_rate;                            /* corrections slowed to the largest rate */
  uint64_t swaps;                                   /* weights taken into use by step */
  uint64_t rollbacks; /* returns to the weights before, after a FAULT */
  uint64_t overruns;  /* steps longer than step_budget_ns */
  uint64_t longest_step_ns;
  uint64_t transitions;
  ravencal_transition last_transitions[RAVENCAL_TRANSITIONS_KEPT]; /* number k of all at k % 16 */
} ravencal_counters;

/* What load made of the last blob that it accepted. */
typedef struct ravencal_info {
  uint32_t struct_size;
  uint32_t isa;               /* RAVENCAL_ISA_* of the network that runs */
  uint32_t inputs;            /* of the blob */
  uint32_t padded_inputs;     /* rounded up to whole vectors of 16 */
  uint64_t parameters;        /* of the blob */
  uint64_t bytes_per_step;    /* weights and scaling read by one step */
  uint32_t memory_locked;     /* 1 if the weights are locked in RAM, 0 if the system refused */
  uint32_t longest_lag_ticks; /* of its oldest input */
  uint32_t checksum;          /* CRC-32C of the blob */
  uint32_t needs_cycle_end;   /* 1 if observe_cycle_end must be called each cycle */
  uint32_t precision;         /* RAVENCAL_PRECISION_* of the weights */
  uint32_t is_signed;         /* 1 if the blob's signature was checked against config.public_key */
  uint32_t arm;               /* RAVENCAL_ARM_* */
  uint32_t coordinates;       /* RAVENCAL_COORDINATES_* */
  char robot[32];             /* that the weights were trained for; "": the blob does not say */
  char controller[32];        /* branch or control mode of the training recordings; "": unknown */
  float constant_ji[RAVENCAL_JOINTS]; /* the part of the correction that state CONSTANT applies */
  uint32_t reserved;
} ravencal_info;

/* One tick, as the flight recorder and the telemetry ring keep it. */
typedef struct ravencal_tick {
  uint64_t tick;
  int64_t t_ns;
  float jpos_ji[RAVENCAL_JOINTS];       /* the robot's own value */
  float correction_ji[RAVENCAL_JOINTS]; /* in SHADOW, what would be added */
  float predicted_ji[RAVENCAL_JOINTS];
  float confidence;
  int32_t enc_counts[RAVENCAL_JOINTS]; /* motors of the calibrated joints */
  int32_t runlevel;
  int32_t state; /* RAVENCAL_STATE_* */
  uint32_t doubts;
  uint32_t step_ns;       /* of this step */
  int32_t would_be_state; /* in SHADOW, the state that it would be in; else state. Since 3.2 */
} ravencal_tick;

#define RAVENCAL_FLIGHT_TICKS 200

/* The last ticks before and with a FAULT. */
typedef struct ravencal_flight {
  uint32_t struct_size;
  uint32_t ticks;                            /* valid entries */
  uint64_t faults;                           /* FAULTs so far; the record is of the last one */
  ravencal_tick tick[RAVENCAL_FLIGHT_TICKS]; /* oldest first */
} ravencal_flight;

typedef struct ravencal_instance ravencal_instance;
typedef struct ravencal_homing_constant ravencal_homing_constant; /* ravencal/control.h */

typedef struct ravencal_api {
  uint32_t struct_size;
  uint32_t abi_major;
  uint32_t abi_minor;
  uint32_t reserved;

  /* [any] Version of the project that built the plugin, e.g. "0.1.0". */
  const char* (*version)(void);

  /* [any] Fills `config` with the defaults; config->struct_size must be set. */
  int32_t (*default_config)(ravencal_config* config);

  /* [any] Bytes and alignment that create needs. */
  size_t (*storage_size)(void);
  size_t (*storage_alignment)(void);

  /* [init] Builds an instance in the host's memory, in state OFF. The host keeps `storage` alive,
   * locked in RAM if it wants that, until destroy. errno says why the system refused
   * telemetry (_IO, _MEMORY, _LIMIT). */
  int32_t (*create)(const ravencal_config* config, void* storage, size_t storage_bytes,
                    ravencal_instance** instance);

  /* [init] Reads and verifies a weight blob. On refusal the instance is unchanged. May be called
   * again from a thread that is not the real-time one while step runs: the new weights are swapped
   * in between two ticks. */
  int32_t (*load)(ravencal_instance* instance, const char* path);

  /* [init] Why the last load was refused; a sentence. Never null. */
  const char* (*last_error)(const ravencal_instance* instance);

  /* [any] Asks the correction to fade in (1: _MODE_ARM) or out (0), while the pedal is up. */
  void (*enable)(ravencal_instance* instance, int32_t on);

  /* [init] What runs; fields beyond info->struct_size are left out.
   * RAVENCAL_ERROR_ARGUMENT before the first successful load. */
  int32_t (*info)(const ravencal_instance* instance, ravencal_info* info);

  /* [rt] One control cycle, called at the hook, where jpos_d_ji of arm[0] is as the controller
   * holds it, with the correction of the cycle before in it: after the forward cable coupling,
   * before the forward kinematics. Returns RAVENCAL_OK, _HELD, _BYPASS or _FAULT;
   * RAVENCAL_ERROR_ARGUMENT, with nothing written, for a null pointer or a struct_size below this
   * version's. */
  int32_t (*step)(ravencal_instance* instance, const ravencal_state* state,
                  ravencal_output* output);

  /* [rt] The control-safe inverse: the joint position that the uncorrected cable coupling must be
   * given so that the corrected joint arrives at desired_ji. It uses the correction of the last
   * step. */
  void (*uncorrect_desired)(const ravencal_instance* instance,
                            const float desired_ji[RAVENCAL_JOINTS],
                            float uncorrected_ji[RAVENCAL_JOINTS]);

  /* [rt] The pose that forward kinematics gives for uncorrected joints 1 to 3, from the pose that
   * it gave for corrected ones. position_um and rotation (row-major) are changed in place; not at
   * all where config.arm is RAVENCAL_ARM_ANY. */
  void (*uncorrect_pose)(const ravencal_instance* instance,
                         const float corrected_ji[RAVENCAL_JOINTS],
                         const float uncorrected_ji[RAVENCAL_JOINTS], int32_t position_um[3],
                         float rotation[9]);

  /* [rt] Called where the controller publishes its state: latches what is zero or one cycle old at
   * the hook (torque, DAC, desired, pose), so that the next step sees what training saw. Desired
   * joints and poses of arm[0] are given without the correction, as a recording made without the
   * plugin has them: uncorrect_desired, uncorrect_pose. */
  void (*observe_cycle_end)(ravencal_instance* instance, const ravencal_state* state);

  /* [any] Copies the counters; counters->struct_size must be set. */
  int32_t (*counters)(const ravencal_instance* instance, ravencal_counters* counters);

  /* [any] Leaves FAULT for OFF at the next step; enable(1) must be called again. */
  void (*reset)(ravencal_instance* instance);

  /* [any] Copies the record of the last FAULT; flight->struct_size must be set.
   * RAVENCAL_ERROR_ARGUMENT while there was none. */
  int32_t (*flight)(const ravencal_instance* instance, ravencal_flight* flight);

  /* [init] Releases what load took. The storage stays the host's. */
  void (*destroy)(ravencal_instance* instance);

  /* Since 3.1. [rt] As uncorrect_desired, right before the inverse cable coupling in every cycle
   * that has one. A press takes away what the desired joints do not hold of the correction
   * (RAVENCAL_DOUBT_PRESS). `commanded` is not read since 3.2. */
  void (*uncorrect_command)(ravencal_instance* instance, const float desired_ji[RAVENCAL_JOINTS],
                            int32_t commanded, float uncorrected_ji[RAVENCAL_JOINTS]);

  /* Since 3.2. [any] RAVENCAL_MODE_*; a correction in force fades out first, with the pedal up. */
  int32_t (*set_mode)(ravencal_instance* instance, int32_t mode);

  /* Since 3.2. [any] How much is applied (0..1), to which joints (bit j), once the pedal is up. */
  int32_t (*set_share)(ravencal_instance* instance, float share, uint32_t joints);

  /* Since 3.3. [init] Adds what a homing left, while weights and homing are those of the constant
   * (ABI.md); null ends it. RAVENCAL_ERROR_ARGUMENT for what is above max_correction_ji. */
  int32_t (*set_homing_constant)(ravencal_instance* instance,
                                 const ravencal_homing_constant* constant);
} ravencal_api;

/* [init] The only exported symbol. Null if `host_abi_major` is not RAVENCAL_ABI_MAJOR. */
typedef const ravencal_api* (*ravencal_plugin_entry_fn)(uint32_t host_abi_major);
const ravencal_api* ravencal_plugin_entry(uint32_t host_abi_major);

/* Sizes and offsets that both sides must agree on. */
#define RAVENCAL_STATIC_ASSERT(name, condition) typedef char name[(condition) ? 1 : -1]
RAVENCAL_STATIC_ASSERT(ravencal_assert_arm_size, sizeof(ravencal_arm) == 476);
RAVENCAL_STATIC_ASSERT(ravencal_assert_arm_enc, offsetof(ravencal_arm, enc_counts) == 100);
RAVENCAL_STATIC_ASSERT(ravencal_assert_arm_jpos, offsetof(ravencal_arm, jpos_ji) == 324);
RAVENCAL_STATIC_ASSERT(ravencal_assert_arm_ready, offsetof(ravencal_arm, joints_ready) == 472);
RAVENCAL_STATIC_ASSERT(ravencal_assert_state_size, sizeof(ravencal_state) == 976);
RAVENCAL_STATIC_ASSERT(ravencal_assert_state_time, offsetof(ravencal_state, t_ns) == 16);
RAVENCAL_STATIC_ASSERT(ravencal_assert_state_arm, offsetof(ravencal_state, arm) == 24);
RAVENCAL_STATIC_ASSERT(ravencal_assert_output_size, sizeof(ravencal_output) == 96);
RAVENCAL_STATIC_ASSERT(ravencal_assert_config_size, sizeof(ravencal_config) == 236);
RAVENCAL_STATIC_ASSERT(ravencal_assert_transition_size, sizeof(ravencal_transition) == 32);
RAVENCAL_STATIC_ASSERT(ravencal_assert_counters_size, sizeof(ravencal_counters) == 968);
RAVENCAL_STATIC_ASSERT(ravencal_assert_info_size, sizeof(ravencal_info) == 144);
RAVENCAL_STATIC_ASSERT(ravencal_assert_tick_size, sizeof(ravencal_tick) == 88);
RAVENCAL_STATIC_ASSERT(ravencal_assert_flight_size, sizeof(ravencal_flight) == 16 + 200 * 88);

#ifdef __cplusplus
}
#endif

#endif /* RAVENCAL_PLUGIN_H */
