// SPDX-License-Identifier: Apache-2.0
//
// A plugin's memory for requests (ravencal/control.h), attached to be written. Other programs of
// this user may write there at the same time.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "core/result.hpp"
#include "ravencal/control.h"

namespace ravencal::control {

class RequestMemory {
 public:
  /// `id`: as the telemetry of that name has it. kIo where it is not this user's alone, or no
  /// plugin's.
  static core::Result<RequestMemory> attach(const std::string& name, int id);
  RequestMemory(RequestMemory&& other) noexcept;
  RequestMemory& operator=(RequestMemory&&) = delete;
  ~RequestMemory();

  [[nodiscard]] std::uint64_t number() const;
  /// Whether a request lies here that a plugin which took `taken` last has still to take.
  [[nodiscard]] bool holds_waiting(std::uint64_t taken) const;
  /// Whether that request lies here, word by word.
  [[nodiscard]] bool holds(const ravencal_request& request) const;
  /// Whether the plugin knows requests for the constant of a homing.
  [[nodiscard]] bool has_room_for_constant() const { return has_room_for_constant_; }
  /// Puts the check to it and stores it; `constant`: of a request for one, which has room.
  void write(ravencal_request& request, const ravencal_homing_constant& constant = {});
  /// Makes it no request, unless another one lies here by now. `taken`: the one taken last.
  void withdraw(const ravencal_request& request, std::uint64_t taken);

 private:
  static constexpr std::size_t kWords = sizeof(ravencal_request) / sizeof(std::uint64_t);
  using Words = std::array<std::uint64_t, kWords>;
  using ConstantWords =
      std::array<std::uint64_t, sizeof(ravencal_constant_request) / sizeof(std::uint64_t)>;

  RequestMemory(std::uint64_t* words, bool has_room_for_constant)
      : words_(words), has_room_for_constant_(has_room_for_constant) {}
  [[nodiscard]] std::atomic_ref<std::uint64_t> word(std::size_t i) const {
    return std::atomic_ref<std::uint64_t>(words_[i]);
  }
  [[nodiscard]] Words load() const;
  void write_constant(ravencal_constant_request record);
  [[nodiscard]] bool holds_constant_of(std::uint64_t number) const;

  std::uint64_t* words_;
  bool has_room_for_constant_;
};

}  // namespace ravencal::control
