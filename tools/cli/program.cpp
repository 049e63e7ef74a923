// SPDX-License-Identifier: Apache-2.0
#include "cli/program.hpp"

#include <csignal>
#include <cstring>
#include <exception>
#include <new>

#include "cli/exit_code.hpp"
#include "core/terminal.hpp"

namespace ravencal::cli {

int run_program(const char* name, const std::function<int()>& body) {
  core::prepare_terminal();
  // A file at the limit of its size is then an error of its write.
  std::signal(SIGXFSZ, SIG_IGN);
  int exit_code = kData;
  try {
    exit_code = body();
  } catch (const std::bad_alloc&) {
    core::remark("{}: there is not enough memory for this\n", name);
  } catch (const std::exception& error) {
    core::remark("{}: {}\n", name, error.what());
  } catch (...) {
    core::remark("{}: failed without a reason; please report how\n", name);
  }
  const core::Unsaid unsaid = core::unsaid();
  if (unsaid.parts == 0) return exit_code;
  core::remark("{}: standard output cannot be written: {}\n", name, std::strerror(unsaid.reason));
  return exit_code == kOk ? kData : exit_code;
}

}  // namespace ravencal::cli
