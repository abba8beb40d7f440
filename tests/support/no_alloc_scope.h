#pragma once

#include <cstddef>

namespace carom::test {

/// Counts the calls of `operator new` by this thread while it lives. Link no_alloc_scope.cpp, which
/// replaces the global operators. It does not see a bare `malloc`.
///
///     const NoAllocScope scope;
///     synth.render(...);
///     EXPECT_EQ(scope.allocations(), 0u);
class NoAllocScope {
 public:
  NoAllocScope();
  std::size_t allocations() const;
  /// Bytes that this thread has asked for since construction; released ones are not subtracted.
  std::size_t bytes() const;

 private:
  std::size_t before_;
  std::size_t bytesBefore_;
};

}  // namespace carom::test
