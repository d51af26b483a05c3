#include <catch2/catch.hpp>

#include "tests/unit/allocations.hpp"
#include "tests/unit/daemon/storage/support.hpp"

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

TEST_CASE("recording samples takes nothing from the heap, however many and over full buffers") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
  REQUIRE(record_samples(*recorder, 0, 9000));  // SQL text and bindings are warm
  const std::size_t before = allocations();
  const Status done = record_samples(*recorder, 0, 9000);
  CHECK(allocations() == before);
  CHECK(done);
}
