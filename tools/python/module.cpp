// SPDX-License-Identifier: Apache-2.0
#include "python/module.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace ravencal::python {
namespace {

/// Exception classes in the order of core::ErrorCode, after their base. They live as long as the
/// process, as the interpreter that holds them.
std::array<PyObject*, 4> error_classes = {};

/// The sentence with the module's word for an option, but not within a command in back quotes.
std::string in_words_of_python(std::string text) {
  constexpr std::string_view kOption = "--skip-bad", kArgument = "skip_bad=True";
  for (std::size_t at = text.find(kOption); at != std::string::npos; at = text.find(kOption, at)) {
    const auto before = text.begin() + static_cast<std::ptrdiff_t>(at);
    const bool in_command = std::count(text.begin(), before, '`') % 2 == 1;
    if (!in_command) text.replace(at, kOption.size(), kArgument);
    at += in_command ? kOption.size() : kArgument.size();
  }
  return text;
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(std::move(thrown));
  } catch (const Failure& failure) {
    const auto code = static_cast<std::size_t>(failure.error().code);
    PyErr_SetString(error_classes.at(code), in_words_of_python(failure.what()).c_str());
  }
}

}  // namespace

void add_errors(py::module_& module) {
  const auto add = [&](const char* name, const char* meaning, PyObject* base) {
    const std::string full = std::string("ravencal.") + name;
    PyObject* const made = PyErr_NewExceptionWithDoc(full.c_str(), meaning, base, nullptr);
    if (made == nullptr) throw py::error_already_set();
    module.add_object(name, made);
    return made;
  };
  PyObject* const base = add("Error", "What ravencal cannot do; the message says why.", nullptr);
  error_classes = {
      add("UsageError", "Asks for something that does not exist or does not fit.", base),
      add("DataError", "The content of a file or of arrays is wrong.", base),
      add("IoError", "The operating system refuses to read or write.", base),
      add("DeviceError", "A device is missing or failed.", base)};
  py::register_local_exception_translator(translate);
}

}  // namespace ravencal::python

PYBIND11_MODULE(_ravencal, module) {
  namespace python = ravencal::python;
  python::add_errors(module);
  python::add_recording(module);
  python::add_plant(module);
  python::add_simulation(module);
  python::add_calibration(module);
  python::add_diagnosis(module);
}
