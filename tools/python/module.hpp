// SPDX-License-Identifier: Apache-2.0
//
// The parts of the Python module `ravencal._ravencal`; package/__init__.py hands them on. Each
// part declares its classes and functions and calls a library for what they do.
#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <utility>

#include "core/result.hpp"

namespace ravencal::python {

namespace py = pybind11;

/// An error of a library on its way into Python: ravencal.UsageError, DataError, IoError or
/// DeviceError with the same sentence.
class Failure : public std::exception {
 public:
  explicit Failure(core::Error error) : error_(std::move(error)) {}
  [[nodiscard]] const core::Error& error() const { return error_; }
  [[nodiscard]] const char* what() const noexcept override { return error_.message.c_str(); }

 private:
  core::Error error_;
};

/// The value, or a Failure.
template <typename T>
T value_of(core::Result<T> result) {
  if (!result.ok()) throw Failure(result.error());
  return std::move(result).value();
}

/// Throws a Failure unless `status` is a success.
inline void succeed(const core::Status& status) {
  if (!status.ok()) throw Failure(status.error());
}

void add_errors(py::module_& module);
void add_recording(py::module_& module);
void add_plant(py::module_& module);
void add_simulation(py::module_& module);
void add_calibration(py::module_& module);
void add_diagnosis(py::module_& module);

}  // namespace ravencal::python
