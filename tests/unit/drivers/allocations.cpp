// Counts what the drivers allocate: they promise none in steady state.

#include <cstdlib>
#include <new>

#include "tests/unit/drivers/fakes.hpp"

namespace {
std::size_t count = 0;
}

std::size_t weft::testing::allocations() {
  return count;
}

// All forms that pair with the deletes below, so that a sanitizer sees one allocator.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++count;
  return std::malloc(size == 0 ? 1 : size);
}
void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
