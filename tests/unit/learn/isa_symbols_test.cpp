// SPDX-License-Identifier: Apache-2.0
//
// A linker keeps one copy of an inline function. If the AVX-512 kernels held one that other files
// hold too, any processor might get to run it. So the objects may share none.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>

namespace {

std::string output_of(const std::string& command) {
  std::string text;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::array<char, 4096> buffer{};
  while (pipe && std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) {
    text += buffer.data();
  }
  return text;
}

TEST(KernelObjects, ShareNoInlineFunctionWithTheRestOfTheProgram) {
  std::istringstream objects(RAVENCAL_KERNEL_OBJECTS);
  std::string object;
  int checked = 0;
  while (std::getline(objects, object, '|')) {
    if (object.find("kernels_avx") == std::string::npos) continue;
    const bool wide = object.find("avx512") != std::string::npos;
    const std::string own = wide ? "Eigen_avx512" : "Eigen_avx2";
    std::istringstream symbols(output_of("nm --defined-only '" + object + "'"));
    std::string address, kind, name;
    int functions = 0;
    while (symbols >> address >> kind >> name) {
      ++functions;
      const bool weak = kind == "W" || kind == "V" || kind == "u";
      if (!weak || name == "DW.ref.__gxx_personality_v0") continue;
      EXPECT_NE(name.find(own), std::string::npos) << object << ": " << name;
    }
    EXPECT_GT(functions, 5) << object << ": nm printed nothing";
    ++checked;
  }
#ifdef RAVENCAL_X86_64_KERNELS
  EXPECT_EQ(checked, 2);
#else
  EXPECT_EQ(checked, 0);
#endif
}

}  // namespace
