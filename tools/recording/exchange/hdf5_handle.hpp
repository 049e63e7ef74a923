// SPDX-License-Identifier: Apache-2.0
//
// Owners of HDF5's handles.
#pragma once

#include <hdf5.h>

#include <utility>

namespace ravencal::exchange {

class Hdf5Handle {
 public:
  using Close = herr_t (*)(hid_t);

  /// Takes what an H5..open or H5..create returned; negative: it failed.
  Hdf5Handle(hid_t id, Close how) : id_(id), close_(how) {}
  Hdf5Handle(Hdf5Handle&& other) noexcept
      : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&&) = delete;
  ~Hdf5Handle() { (void)close(); }

  [[nodiscard]] bool ok() const { return id_ >= 0; }
  [[nodiscard]] hid_t get() const { return id_; }
  /// False: what was left to write could not be written.
  bool close() {
    const hid_t id = std::exchange(id_, H5I_INVALID_HID);
    return id < 0 || close_(id) >= 0;
  }

 private:
  hid_t id_;
  Close close_;
};

/// Opens a file to read it. HDF5 then follows no link into another file; stands_alone() says
/// whether values lie in others, too.
inline Hdf5Handle hdf5_open(const char* path) {
  static const herr_t no_links = H5Lunregister(H5L_TYPE_EXTERNAL);
  (void)no_links;
  return {H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose};
}

/// False where a dataset of the file takes its values from another file: any that its reader may
/// read.
inline bool stands_alone(const Hdf5Handle& file) {
  const auto look = [](hid_t at, const char* name, const H5O_info_t* info, void*) -> herr_t {
    if (info->type != H5O_TYPE_DATASET) return 0;
    const Hdf5Handle set(H5Dopen2(at, name, H5P_DEFAULT), H5Dclose);
    const Hdf5Handle made(H5Dget_create_plist(set.get()), H5Pclose);
    const bool is_elsewhere = made.ok() && (H5Pget_external_count(made.get()) > 0 ||
                                            H5Pget_layout(made.get()) == H5D_VIRTUAL);
    return is_elsewhere ? 1 : 0;
  };
  return H5Ovisit2(file.get(), H5_INDEX_NAME, H5_ITER_NATIVE, look, nullptr, H5O_INFO_BASIC) <= 0;
}

/// What to say of one that does not.
inline constexpr const char* kLiesElsewhere =
    "takes values from another file, which is not read; write them into the file itself "
    "(h5repack does)";

/// Before anything else of HDF5: it prints no errors, because the caller says what went wrong, and
/// does nothing at the program's end, where it would write to a full disk once more and crash.
inline void hdf5_quiet() {
  static const herr_t no_end = H5dont_atexit();
  (void)no_end;
  (void)H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

}  // namespace ravencal::exchange
