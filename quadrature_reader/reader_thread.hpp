// SPDX-License-Identifier: Apache-2.0
//
// One thread per source: reads the device, pushes readings into the ring, opens the device again
// after a failure. A reading that finds the ring full is counted, and the count is delivered as a
// loss of every axis as soon as there is room.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "core/spsc_ring.hpp"
#include "quadrature_reader/sources/source.hpp"

namespace ravencal::quadrature_reader {

class ReaderThread {
 public:
  /// `source` has been opened. `realtime_priority` 1 to 99: SCHED_FIFO where permitted; 0: ordinary
  /// scheduling.
  ReaderThread(std::unique_ptr<Source> source, std::size_t ring_capacity, int realtime_priority);
  ~ReaderThread();  ///< stops and joins
  ReaderThread(const ReaderThread&) = delete;
  ReaderThread& operator=(const ReaderThread&) = delete;

  void start();
  void stop();

  /// Consumer side: the one thread that works the readings off.
  core::SpscRing<Reading>& ring() { return ring_; }
  /// Any thread: the source said that nothing more will come, and all of it is in the ring.
  [[nodiscard]] bool finished() const { return finished_.load(std::memory_order_acquire); }
  /// Any thread: why the device last failed; empty if it never did.
  [[nodiscard]] std::string last_error() const;
  /// Any thread: real-time scheduling was asked for and refused.
  [[nodiscard]] bool scheduling_refused() const { return scheduling_refused_.load(); }

 private:
  void run();
  bool open_device();
  void fail(const core::Error& error);
  void push(const Reading& reading);
  void sleep_unless_stopped(std::chrono::milliseconds time);

  std::unique_ptr<Source> source_;  // reader thread
  core::SpscRing<Reading> ring_;
  int realtime_priority_;
  std::int64_t refused_readings_ = 0;  // reader thread
  bool device_failed_ = false;         // reader thread
  std::atomic<bool> stop_{false};
  std::atomic<bool> finished_{false};
  std::atomic<bool> scheduling_refused_{false};
  mutable std::mutex error_mutex_;
  std::string last_error_;  // guarded by error_mutex_
  std::thread thread_;
};

}  // namespace ravencal::quadrature_reader
