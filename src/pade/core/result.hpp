// A value or the reason why there is none. Errors are values at the rim of the program; no exception is
// thrown by the project's own code.
#pragma once

#include <string>
#include <utility>
#include <variant>

namespace pade {

/// Why something was refused or skipped. The message names the file, the line or field, what was found and
/// what was expected, and reads as one sentence without a full stop.
struct Error {
  std::string message;  ///< for a person
};

/// Either a value of type T or an Error.
template <class T>
class [[nodiscard]] Result {
 public:
  /// @{
  /// Not explicit, so that a function can return either.
  // NOLINTBEGIN
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}
  // NOLINTEND
  /// @}

  /// True if there is a value, false if there is an error.
  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }  ///< ok()

  /// @{
  /// The value. Only if ok(): otherwise std::bad_variant_access is thrown.
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  /// @}

  /// The reason. Only if not ok(): otherwise std::bad_variant_access is thrown.
  [[nodiscard]] const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

/// The result of something that has no value.
class [[nodiscard]] Status {
 public:
  Status() = default;  ///< success
  // NOLINTNEXTLINE: not explicit, so that a function can return either
  Status(Error error) : failed_(true), error_(std::move(error)) {}  ///< a failure
  [[nodiscard]] bool ok() const { return !failed_; }                ///< true of a success
  explicit operator bool() const { return ok(); }                   ///< ok()
  [[nodiscard]] const Error& error() const { return error_; }       ///< the reason; empty if ok()

 private:
  bool failed_ = false;
  Error error_;
};

}  // namespace pade
