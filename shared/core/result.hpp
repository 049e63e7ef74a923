// SPDX-License-Identifier: Apache-2.0
//
// Result<T>: a value or the reason why there is none. Libraries return it for every failure that
// a user can cause (file, device, argument); a value that is not there throws why. A type of our
// own because clang 14, which runs the static checks and the fuzzers, does not see gcc 12's
// std::expected.
// Not for real-time code: an Error owns a string.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace ravencal::core {

/// Kinds of failure; tools/cli/exit_code.hpp maps each to a process exit code.
enum class ErrorCode {
  kUsage,   ///< The caller asked for something that does not exist or does not fit.
  kData,    ///< A file's content is wrong.
  kIo,      ///< The operating system refused to read or write.
  kDevice,  ///< A device is missing or failed.
};

/// Why something failed, as one sentence for the user: what, where (file:line: column), the value
/// found, and the remedy where there is one.
struct Error {
  ErrorCode code = ErrorCode::kData;
  std::string message;
};

inline Error usage_error(std::string message) { return {ErrorCode::kUsage, std::move(message)}; }
inline Error data_error(std::string message) { return {ErrorCode::kData, std::move(message)}; }
inline Error io_error(std::string message) { return {ErrorCode::kIo, std::move(message)}; }
inline Error device_error(std::string message) { return {ErrorCode::kDevice, std::move(message)}; }

template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return std::holds_alternative<T>(state_); }
  explicit operator bool() const { return ok(); }

  [[nodiscard]] T& value() & {
    check();
    return *std::get_if<T>(&state_);
  }
  [[nodiscard]] const T& value() const& {
    check();
    return *std::get_if<T>(&state_);
  }
  [[nodiscard]] T&& value() && {
    check();
    return std::move(*std::get_if<T>(&state_));
  }
  [[nodiscard]] const Error& error() const {
    if (const Error* const error = std::get_if<Error>(&state_)) return *error;
    throw std::logic_error("the error of what succeeded was asked for");
  }

  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

 private:
  void check() const {
    if (const Error* const error = std::get_if<Error>(&state_))
      throw std::logic_error(error->message);
  }

  std::variant<T, Error> state_;
};

/// Success, or the reason of failure.
class [[nodiscard]] Status {
 public:
  Status() = default;
  // NOLINTNEXTLINE(google-explicit-constructor)
  Status(Error error) : error_(std::move(error)), ok_(false) {}

  [[nodiscard]] bool ok() const { return ok_; }
  explicit operator bool() const { return ok_; }
  /// Empty after success.
  [[nodiscard]] const Error& error() const { return error_; }

 private:
  Error error_;
  bool ok_ = true;
};

}  // namespace ravencal::core

#define RAVENCAL_CONCAT_INNER(a, b) a##b
#define RAVENCAL_CONCAT(a, b) RAVENCAL_CONCAT_INNER(a, b)

/// Returns the error of `expr` (a Status or a Result) from the enclosing function, if it has one.
#define RAVENCAL_RETURN_IF_ERROR(expr)                        \
  if (auto ravencal_status = (expr); !ravencal_status.ok()) { \
    return ravencal_status.error();                           \
  }                                                           \
  static_assert(true)

/// Declares `decl` with the value of `expr` (a Result), or returns its error.
#define RAVENCAL_ASSIGN_OR_RETURN(decl, expr)                     \
  auto RAVENCAL_CONCAT(ravencal_result_, __LINE__) = (expr);      \
  if (!RAVENCAL_CONCAT(ravencal_result_, __LINE__).ok()) {        \
    return RAVENCAL_CONCAT(ravencal_result_, __LINE__).error();   \
  }                                                               \
  /* A declaration. NOLINTNEXTLINE(bugprone-macro-parentheses) */ \
  decl = std::move(RAVENCAL_CONCAT(ravencal_result_, __LINE__)).value()
