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

/// While it lives, `operator new` gives this thread so many pieces of memory more, and fails then,
/// once.
class FailingAllocation {
 public:
  explicit FailingAllocation(std::size_t piecesBefore);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;
  bool hasFailed() const;
};

}  // namespace carom::test
