#include "tests/support/no_alloc_scope.h"

#include <cstdlib>
#include <new>

namespace {

thread_local constinit std::size_t allocationsOfThread = 0;
thread_local constinit std::size_t bytesOfThread = 0;
thread_local constinit std::size_t piecesUntilFailure =
    0;  // the last of them is not given; 0: none

bool isToFail() {
  return piecesUntilFailure > 0 && --piecesUntilFailure == 0;
}

void* countedAllocation(std::size_t size) {
  ++allocationsOfThread;
  bytesOfThread += size;
  if (isToFail()) return nullptr;
  return std::malloc(size == 0 ? 1 : size);  // NOLINT: this is `new`
}

void* countedAllocation(std::size_t size, std::align_val_t alignment) {
  ++allocationsOfThread;
  bytesOfThread += size;
  if (isToFail()) return nullptr;
  const auto step = static_cast<std::size_t>(alignment);
  return std::aligned_alloc(step, (size + step - 1) / step * step);  // NOLINT: as above
}

void* orThrow(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void release(void* memory) noexcept {
  std::free(memory);  // NOLINT: as above
}

}  // namespace

// The standard library's array and nothrow forms call these.
void* operator new(std::size_t size) {
  return orThrow(countedAllocation(size));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return orThrow(countedAllocation(size, alignment));
}
void operator delete(void* memory) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  release(memory);
}

// The remaining forms are spelled out because a sanitizer brings its own, which do not call ours.
void* operator new[](std::size_t size) {
  return orThrow(countedAllocation(size));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return countedAllocation(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return countedAllocation(size);
}
void operator delete[](void* memory) noexcept {
  release(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
  release(memory);
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  release(memory);
}

namespace carom::test {

NoAllocScope::NoAllocScope() : before_(allocationsOfThread), bytesBefore_(bytesOfThread) {}

std::size_t NoAllocScope::allocations() const {
  return allocationsOfThread - before_;
}

std::size_t NoAllocScope::bytes() const {
  return bytesOfThread - bytesBefore_;
}

FailingAllocation::FailingAllocation(std::size_t piecesBefore) {
  piecesUntilFailure = piecesBefore + 1;
}

FailingAllocation::~FailingAllocation() {
  piecesUntilFailure = 0;
}

bool FailingAllocation::hasFailed() const {
  return piecesUntilFailure == 0;
}

}  // namespace carom::test
