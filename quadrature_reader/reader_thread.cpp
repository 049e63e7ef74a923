// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/reader_thread.hpp"

#include <pthread.h>

#include <cerrno>

namespace ravencal::quadrature_reader {
namespace {

constexpr auto kReadTimeout = std::chrono::milliseconds(10);
constexpr auto kRetryPeriod = std::chrono::milliseconds(500);
constexpr std::size_t kLargestRead = 4096;

}  // namespace

ReaderThread::ReaderThread(std::unique_ptr<Source> source, std::size_t ring_capacity,
                           int realtime_priority)
    : source_(std::move(source)), ring_(ring_capacity), realtime_priority_(realtime_priority) {}

ReaderThread::~ReaderThread() { stop(); }

void ReaderThread::start() {
  thread_ = std::thread([this] { run(); });
}

void ReaderThread::stop() {
  stop_.store(true);
  if (thread_.joinable()) thread_.join();
}

std::string ReaderThread::last_error() const {
  const std::lock_guard lock(error_mutex_);
  return last_error_;
}

void ReaderThread::run() {
  if (realtime_priority_ > 0) {
    sched_param parameters{};
    parameters.sched_priority = realtime_priority_;
    scheduling_refused_ = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) != 0;
  }
  std::vector<Reading> readings;
  readings.reserve(kLargestRead);
  bool open = true;
  while (!stop_.load(std::memory_order_relaxed)) {
    if (!open) {
      sleep_unless_stopped(kRetryPeriod);
      open = open_device();
      continue;
    }
    readings.clear();
    const core::Status status = source_->read(readings, kReadTimeout);
    for (const auto& reading : readings) push(reading);
    if (!status.ok()) {
      fail(status.error());
      open = false;
    }
    if (source_->finished()) break;
  }
  finished_.store(source_->finished(), std::memory_order_release);
}

bool ReaderThread::open_device() {
  const core::Status status = source_->open();
  if (!status.ok()) {
    fail(status.error());
    return false;
  }
  if (device_failed_) {
    push(
        {monotonic_now_ns(), 0, kEveryAxis, ReadingKind::kRecovered, Line::kA, Fault::kDeviceGone});
  }
  device_failed_ = false;
  return true;
}

void ReaderThread::fail(const core::Error& error) {
  {
    const std::lock_guard lock(error_mutex_);
    last_error_ = error.message;
  }
  if (!device_failed_) {
    push(
        {monotonic_now_ns(), errno, kEveryAxis, ReadingKind::kFault, Line::kA, Fault::kDeviceGone});
  }
  device_failed_ = true;
}

void ReaderThread::push(const Reading& reading) {
  if (source_->patient()) {
    while (!ring_.try_push(reading) && !stop_.load(std::memory_order_relaxed)) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    return;
  }
  if (refused_readings_ > 0) {
    const Reading loss{reading.t_ns,       0,        kEveryAxis,
                       ReadingKind::kLost, Line::kA, Fault::kRingOverflow};
    if (!ring_.try_push(loss)) {
      ++refused_readings_;
      return;
    }
    refused_readings_ = 0;
  }
  if (!ring_.try_push(reading) && reading.kind != ReadingKind::kAlive) ++refused_readings_;
}

void ReaderThread::sleep_unless_stopped(std::chrono::milliseconds time) {
  const auto until = std::chrono::steady_clock::now() + time;
  while (!stop_.load() && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

}  // namespace ravencal::quadrature_reader
