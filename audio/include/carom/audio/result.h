#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace carom {

/// Why an input was refused: what is wrong, where, and what would be accepted, in one sentence
/// that can be shown to the user as it is.
struct Error {
  std::string message;
};

/// A value, or the reason why there is none. For bad input only (files, arguments, numbers that a
/// world hands over); a broken promise inside the program is an assertion. [any thread]
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value)
      : state_(std::in_place_index<0>, std::move(value)) {
  }  // NOLINT: implicit, so that `return value;` reads
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: as above

  explicit operator bool() const { return state_.index() == 0; }

  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  T&& operator*() && { return std::move(value()); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }

  /// The reason why there is no value. Requires that there is none.
  const Error& error() const {
    assert(state_.index() == 1);
    return *std::get_if<1>(&state_);
  }

 private:
  const T& value() const {
    assert(state_.index() == 0);
    return *std::get_if<0>(&state_);
  }
  T& value() {
    assert(state_.index() == 0);
    return *std::get_if<0>(&state_);
  }

  std::variant<T, Error> state_;
};

/// The outcome of an action that yields nothing.
using Status = Result<std::monostate>;

}  // namespace carom
