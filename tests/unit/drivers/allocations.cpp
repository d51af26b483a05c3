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

void* operator new(std::size_t size) {
  ++count;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
