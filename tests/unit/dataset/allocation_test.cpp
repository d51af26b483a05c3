// Counts what this test program takes from the heap through operator new.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <new>

#include "tests/unit/dataset/support.hpp"

namespace {
std::size_t allocations = 0;
}

void* operator new(std::size_t bytes) {
  ++allocations;
  if (void* memory = std::malloc(bytes)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

TEST_CASE("recording samples takes nothing from the heap, however many and over full buffers") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
  REQUIRE(record_samples(*recorder, 0, 9000));  // SQL text and bindings are warm
  const std::size_t before = allocations;
  const Status done = record_samples(*recorder, 0, 9000);
  CHECK(allocations == before);
  CHECK(done);
}
