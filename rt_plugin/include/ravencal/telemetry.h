/* SPDX-License-Identifier: Apache-2.0
 *
 * The shared memory that a plugin with a telemetry_name writes, for those who watch it. Plain C90.
 * The plugin never reads it and never waits for anyone. How to find it:
 *   1. read ravencal_telemetry_label from the file /dev/shm/NAME;
 *   2. attach the System V segment that it names, read-only: shmat(memory_id, 0, SHM_RDONLY). If
 *      there is none, the writer has died. The segment is one header, then a ring of ticks;
 *   3. compare the segment's label with the file's: another one belongs to somebody else.
 * The writer holds an exclusive flock on the file for as long as it lives: a shared one that is
 * refused (LOCK_SH | LOCK_NB) says that it does; let go of one that is granted at once.
 *
 * Whatever changes is made of aligned 64-bit words, each stored and to be loaded atomically,
 * guarded by a sequence word that is odd while the guarded words are being written:
 *   1. load the sequence with acquire order; try again later if it is odd;
 *   2. load every guarded word with acquire order;
 *   3. load the sequence again: what was loaded is whole if it is still the same.
 * The plugin stores an odd sequence, then every word with release order, then the next even
 * sequence with release order. (Boehm, "Can seqlocks get along with programming language memory
 * models?", 2012: no fences needed, plain moves on x86.)
 */
#ifndef RAVENCAL_TELEMETRY_H
#define RAVENCAL_TELEMETRY_H

#include "ravencal/control.h"
#include "ravencal/plugin.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RAVENCAL_TELEMETRY_MAGIC "RAVENTEL" /* 8 characters, without the terminating zero */
#define RAVENCAL_TELEMETRY_VERSION 3u
#define RAVENCAL_TELEMETRY_SLOTS 2048u /* two seconds at 1 kHz; a power of two */
#define RAVENCAL_TELEMETRY_HEADER_BYTES 4096u

/* One tick. Number n (the first is 0) is in slot n % slot_count, whose sequence is then 2 n + 2;
 * a greater one says that it has been overwritten, a smaller one that it is not there yet. */
typedef struct ravencal_telemetry_slot {
  uint64_t sequence;
  ravencal_tick tick;
  float offset_ji[RAVENCAL_JOINTS]; /* correction minus the wanted one, because motors follow it */
  uint32_t reserved;
} ravencal_telemetry_slot;

/* What the file holds and the segment begins with. Complete before the file gets its name; never
 * changed. */
typedef struct ravencal_telemetry_label {
  char magic[8];
  uint32_t version;
  int32_t memory_id;     /* of shmat */
  uint32_t header_bytes; /* where slot 0 starts */
  uint32_t slot_bytes;
  uint32_t slot_count;
  uint32_t tick_ns; /* ravencal_config.tick_ns */
  uint32_t writer_pid;
  int32_t request_id;        /* of shmat: ravencal/control.h */
  int64_t start_realtime_ns; /* when the plugin was created, since 1970 */
  char plugin_version[24];
} ravencal_telemetry_label;

/* Of the newest tick, guarded by counters_sequence; zeros in plugins before 3.3. */
typedef struct ravencal_telemetry_homing {
  ravencal_homing_constant constant;          /* in force; weights_checksum 0: none */
  int32_t enc_offset_counts[RAVENCAL_JOINTS]; /* that the robot has now */
  uint32_t is_homed;                          /* 1: joints 1 to 3 are ready */
  uint32_t weights_checksum;                  /* of the weights in use; 0: none */
  uint32_t reserved;
} ravencal_telemetry_homing;

typedef struct ravencal_telemetry_header {
  ravencal_telemetry_label label;

  /* Changing. */
  uint64_t closed;            /* 1: the writer has ended in order and removed the name */
  uint64_t written;           /* ticks written so far */
  uint64_t counters_sequence; /* guards counters */
  ravencal_counters counters;
  uint64_t request_taken; /* number of the request that was taken last: ravencal/control.h */
  ravencal_telemetry_homing homing; /* since 3.3 */
} ravencal_telemetry_header;

RAVENCAL_STATIC_ASSERT(ravencal_assert_telemetry_slot, sizeof(ravencal_telemetry_slot) == 112);
RAVENCAL_STATIC_ASSERT(ravencal_assert_telemetry_closed,
                       offsetof(ravencal_telemetry_header, closed) == 72);
RAVENCAL_STATIC_ASSERT(ravencal_assert_telemetry_header,
                       sizeof(ravencal_telemetry_header) == 72 + 24 + 968 + 8 + 56);

#ifdef __cplusplus
}
#endif

#endif /* RAVENCAL_TELEMETRY_H */
