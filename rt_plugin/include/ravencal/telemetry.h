/* SPDX-License-Identifier: Apache-2.0
 *
 * The shared memory that a plugin with a telemetry_name writes, for those who watch it. Plain C90.
 * It is the file /dev/shm/NAME (shm_open's place on Linux): one header, then a ring of ticks. Map
 * it read-only. The plugin never reads it and never waits for anyone.
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

#include "ravencal/plugin.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RAVENCAL_TELEMETRY_MAGIC "RAVENTEL" /* 8 characters, without the terminating zero */
#define RAVENCAL_TELEMETRY_VERSION 1u
#define RAVENCAL_TELEMETRY_SLOTS 2048u /* two seconds at 1 kHz; a power of two */
#define RAVENCAL_TELEMETRY_HEADER_BYTES 4096u

/* One tick. Number n (the first is 0) is in slot n % slot_count, whose sequence is then 2 n + 2;
 * a greater one says that it has been overwritten, a smaller one that it is not there yet. */
typedef struct ravencal_telemetry_slot {
  uint64_t sequence;
  ravencal_tick tick;
} ravencal_telemetry_slot;

typedef struct ravencal_telemetry_header {
  /* Complete before the file gets its name; never changed. */
  char magic[8];
  uint32_t version;
  uint32_t header_bytes; /* where slot 0 starts */
  uint32_t slot_bytes;
  uint32_t slot_count;
  uint32_t tick_ns; /* ravencal_config.tick_ns */
  uint32_t writer_pid;
  int64_t start_realtime_ns; /* when the plugin was created, since 1970 */
  char plugin_version[24];

  /* Changing. The writer holds an exclusive flock on the file for as long as it lives. */
  uint64_t closed;            /* 1: the writer has ended in order and removed the name */
  uint64_t written;           /* ticks written so far */
  uint64_t counters_sequence; /* guards counters */
  ravencal_counters counters;
} ravencal_telemetry_header;

RAVENCAL_STATIC_ASSERT(ravencal_assert_telemetry_slot, sizeof(ravencal_telemetry_slot) == 96);
RAVENCAL_STATIC_ASSERT(ravencal_assert_telemetry_closed,
                       offsetof(ravencal_telemetry_header, closed) == 64);
RAVENCAL_STATIC_ASSERT(ravencal_assert_telemetry_header,
                       sizeof(ravencal_telemetry_header) == 64 + 24 + 968);

#ifdef __cplusplus
}
#endif

#endif /* RAVENCAL_TELEMETRY_H */
