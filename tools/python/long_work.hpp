// SPDX-License-Identifier: Apache-2.0
//
// Work that may take long: it runs on a thread of its own without Python's lock, while the calling
// thread looks for Ctrl-C and tells the caller how far the work is.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "python/module.hpp"

namespace ravencal::python {

/// How long Ctrl-C waits at most until it is seen; what the work needs to stop comes on top.
inline constexpr std::chrono::milliseconds kLookPeriod{50};

/// Between the work and the caller's `progress(share, what)`, None or a callable.
class Watch {
 public:
  explicit Watch(py::object progress);

  /// For the work, on any of its threads: says how far it is; false asks it to stop.
  bool go_on(double share, std::string_view what);
  /// For the calling thread, which holds Python's lock: looks for signals and calls `progress`.
  /// What either raises is kept, and asks the work to stop.
  void look();
  /// Raises what look() kept.
  void raise() const;

 private:
  py::object progress_;
  std::optional<py::error_already_set> raised_;
  std::mutex mutex_;  // of what follows
  double share_ = 0.0;
  std::string what_;
  bool is_news_ = false;
  bool stop_ = false;
};

/// The value of `work(watch)`, a core::Result. Throws a Failure, or what look() kept. `work` uses
/// no Python object.
template <typename Work>
auto away_from_python(const py::object& progress, const Work& work) {
  Watch watch(progress);
  auto result = std::async(std::launch::async, [&] { return work(watch); });
  const auto is_ready = [&] {
    const py::gil_scoped_release unlocked;
    return result.wait_for(kLookPeriod) == std::future_status::ready;
  };
  while (!is_ready()) watch.look();
  watch.look();
  watch.raise();
  return value_of(result.get());
}

}  // namespace ravencal::python
