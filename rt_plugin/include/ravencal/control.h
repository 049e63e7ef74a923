/* SPDX-License-Identifier: Apache-2.0
 *
 * The shared memory in which a program of the same user asks a plugin with a telemetry_name for
 * something (`ravencal control`). Plain C90. How to ask:
 *   1. find the telemetry as ravencal/telemetry.h says; label.request_id names a System V segment
 *      of mode 0600 that holds one ravencal_request. Go on only if its owner is this user;
 *   2. store the words of the request from the second on, then its number, each atomically and with
 *      release order; of a _HOMING_CONSTANT, the words of the ravencal_constant_request before
 * them. A segment without room for that is of a plugin before 3.3, which knows no such request;
 *   3. the plugin has taken it once ravencal_telemetry_header.request_taken is its number.
 * The plugin reads one request per cycle, without waiting. It takes "off" and "reset" at once, all
 * else while the pedal is up, and waits for that. It ignores a request whose check is wrong, whose
 * version or kind it does not know, and one that is older than itself or than the one it took last.
 */
#ifndef RAVENCAL_CONTROL_H
#define RAVENCAL_CONTROL_H

#include "ravencal/plugin.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Since 3.3. What one homing adds to the error of the joints, beside what the weights predict: told
 * by one known pose (`ravencal rezero`). It belongs to these weights and to this homing. */
struct ravencal_homing_constant {
  uint32_t struct_size;
  uint32_t weights_checksum;                  /* ravencal_info.checksum */
  float constant_ji[RAVENCAL_JOINTS];         /* to be added */
  int32_t enc_offset_counts[RAVENCAL_JOINTS]; /* of the state, as this homing found them */
};

#define RAVENCAL_REQUEST_VERSION 1u

#define RAVENCAL_REQUEST_OFF 0u             /* set_mode(RAVENCAL_MODE_OFF) */
#define RAVENCAL_REQUEST_ARM 1u             /* set_mode(RAVENCAL_MODE_ARM) */
#define RAVENCAL_REQUEST_SHADOW 2u          /* set_mode(RAVENCAL_MODE_SHADOW) */
#define RAVENCAL_REQUEST_SHARE 3u           /* set_share(share, joints) */
#define RAVENCAL_REQUEST_RESET 4u           /* reset() */
#define RAVENCAL_REQUEST_HOMING_CONSTANT 5u /* set_homing_constant(); since 3.3 */
#define RAVENCAL_REQUEST_KINDS 6u

typedef struct ravencal_request {
  uint64_t number; /* nanoseconds since 1970 when it was made, and more than that of the last one */
  uint32_t version; /* RAVENCAL_REQUEST_VERSION */
  uint32_t kind;    /* RAVENCAL_REQUEST_* */
  float share;      /* 0..1; of _SHARE alone */
  uint32_t joints;  /* bit j: joint j; of _SHARE alone */
  uint64_t check;   /* RAVENCAL_REQUEST_CHECK of the three words before */
} ravencal_request;

/* Tells half a request, and what is none, from a request. */
#define RAVENCAL_REQUEST_CHECK(first, second, third)                                \
  ((uint64_t)(first)*0x9E3779B97F4A7C15u ^ (uint64_t)(second)*0xC2B2AE3D27D4EB4Fu ^ \
   (uint64_t)(third)*0x165667B19E3779F9u)

/* Since 3.3. What a _HOMING_CONSTANT asks for, right behind the request. */
typedef struct ravencal_constant_request {
  uint64_t number; /* of the request */
  ravencal_homing_constant constant;
  uint64_t check; /* RAVENCAL_CONSTANT_CHECK of the five words before */
} ravencal_constant_request;

#define RAVENCAL_CONSTANT_CHECK(first, second, third, fourth, fifth) \
  RAVENCAL_REQUEST_CHECK(RAVENCAL_REQUEST_CHECK(first, second, third), fourth, fifth)

RAVENCAL_STATIC_ASSERT(ravencal_assert_homing_constant_size,
                       sizeof(ravencal_homing_constant) == 32);
RAVENCAL_STATIC_ASSERT(ravencal_assert_request_size, sizeof(ravencal_request) == 32);
RAVENCAL_STATIC_ASSERT(ravencal_assert_constant_request_size,
                       sizeof(ravencal_constant_request) == 48);

#ifdef __cplusplus
}
#endif

#endif /* RAVENCAL_CONTROL_H */
