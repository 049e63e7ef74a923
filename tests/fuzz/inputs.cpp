// SPDX-License-Identifier: Apache-2.0
#include "fuzz/inputs.hpp"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace ravencal::fuzz {
namespace fs = std::filesystem;
namespace {

class Folder {
 public:
  Folder() {
    std::error_code absent;
    const fs::path memory = "/dev/shm";
    const fs::path parent = fs::is_directory(memory, absent) ? memory : fs::temp_directory_path();
    std::string name = (parent / "ravencal_fuzz_XXXXXX").string();
    const char* const made = ::mkdtemp(name.data());
    promise(made != nullptr, "there is room for a folder of files");
    path_ = made;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

void promise(bool kept, std::string_view what) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %.*s\n", static_cast<int>(what.size()), what.data());
  std::abort();
}

void promise_words(const core::Error& error, std::string_view file) {
  if (error.message.find(file) == std::string::npos) {
    std::fprintf(stderr, "message: %s\n", error.message.c_str());
  }
  promise(error.message.find(file) != std::string::npos, "an error names its file");
  promise(error.message.size() > file.size() + 10, "an error says what is wrong");
}

fs::path scratch_path(std::string_view name) {
  static const Folder folder;
  return folder.path() / name;
}

fs::path scratch_file(std::string_view name, Bytes bytes) {
  fs::path path = scratch_path(name);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return path;
}

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace ravencal::fuzz
