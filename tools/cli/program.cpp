// SPDX-License-Identifier: Apache-2.0
#include "cli/program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>

#include "cli/exit_code.hpp"

namespace ravencal::cli {

int run_program(const char* name, const std::function<int()>& body) {
  // A file at the limit of its size is then an error of its write.
  std::signal(SIGXFSZ, SIG_IGN);
  int exit_code = kData;
  try {
    exit_code = body();
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: there is not enough memory for this\n", name);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
  } catch (...) {
    fmt::print(stderr, "{}: failed without a reason; please report how\n", name);
  }
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return exit_code;
  // The write that failed may lie far back, and its errno with it: another write says why.
  errno = 0;
  (void)!::write(STDOUT_FILENO, "\n", 1);
  fmt::print(stderr, "{}: standard output cannot be written{}{}\n", name, errno == 0 ? "" : ": ",
             errno == 0 ? "" : std::strerror(errno));
  return exit_code == kOk ? kData : exit_code;
}

}  // namespace ravencal::cli
