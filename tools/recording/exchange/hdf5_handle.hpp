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

/// Before anything else of HDF5: it prints no errors, because the caller says what went wrong, and
/// does nothing at the program's end, where it would write to a full disk once more and crash.
inline void hdf5_quiet() {
  static const herr_t no_end = H5dont_atexit();
  (void)no_end;
  (void)H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

}  // namespace ravencal::exchange
