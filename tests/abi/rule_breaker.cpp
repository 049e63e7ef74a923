// SPDX-License-Identifier: Apache-2.0
//
// A library that breaks every rule of the plugin's object: two exported symbols, exceptions and
// run-time types, the C++ runtime, and a symbol that only a recent C library has (fstat, 2.33).
#include <sys/stat.h>

#include <stdexcept>
#include <string>
#include <typeinfo>

struct Base {
  virtual ~Base() = default;
};
struct Derived : Base {};

extern "C" int first_symbol(int file) {
  struct stat status {};
  if (::fstat(file, &status) != 0) throw std::runtime_error(typeid(Base).name());
  return static_cast<int>(status.st_size);
}

extern "C" int second_symbol(Base* base) {
  try {
    return dynamic_cast<Derived*>(base) != nullptr ? first_symbol(0) : 0;
  } catch (const std::runtime_error& error) {
    return static_cast<int>(std::string(error.what()).size());
  }
}
