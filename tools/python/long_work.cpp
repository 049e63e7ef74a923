// SPDX-License-Identifier: Apache-2.0
#include "python/long_work.hpp"

#include <utility>

namespace ravencal::python {

Watch::Watch(py::object progress) : progress_(std::move(progress)) {
  if (!progress_.is_none() && PyCallable_Check(progress_.ptr()) == 0)
    throw py::type_error("progress is no function of share and text");
}

bool Watch::go_on(double share, std::string_view what) {
  const std::lock_guard lock(mutex_);
  is_news_ = true;
  share_ = share;
  what_ = what;
  return !stop_;
}

void Watch::look() {
  if (raised_) return;
  try {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    std::unique_lock lock(mutex_);
    const bool tell = std::exchange(is_news_, false) && !progress_.is_none();
    const double share = share_;
    const std::string what = what_;
    lock.unlock();
    if (tell) progress_(share, what);
  } catch (py::error_already_set& error) {
    raised_.emplace(error);
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
}

void Watch::raise() const {
  if (raised_) throw py::error_already_set(*raised_);
}

}  // namespace ravencal::python
