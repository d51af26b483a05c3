// The wall clock is set back while the daemon runs: records and waiting times do not depend on it.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/service/rpc/leases.hpp"
#include "daemon/service/rpc/tokens.hpp"
#include "daemon/service/runs/run_manager.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace clock_set_back_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;
using test::TemporaryFolder;

namespace {

/// A machine with two clocks set by a test.
struct Clocks {
  std::chrono::nanoseconds wall = 1000h, steady = 5s;
  MonotonicUtcClock rising;
  void pass(std::chrono::nanoseconds time) {
    wall += time;
    steady += time;
  }
  std::int64_t utc_us() { return rising.now(wall, steady).count() / 1000; }
};

}  // namespace

TEST_CASE("UTC follows the monotonic clock after the wall clock is set back") {
  Clocks c;
  const std::int64_t first = c.utc_us();
  c.pass(10s);
  CHECK(c.utc_us() == first + 10'000'000);
  c.wall -= 1h;
  c.pass(3s);
  CHECK(c.utc_us() == first + 13'000'000);
  c.pass(2h);
  CHECK(c.utc_us() == first + 13'000'000 + 7'200'000'000);
  c.wall += 3h;  // more than it was set back
  CHECK(c.utc_us() == c.wall.count() / 1000);
  CHECK(c.utc_us() > first + 13'000'000 + 7'200'000'000);
}

TEST_CASE("UTC stops if neither clock moves, and never decreases") {
  MonotonicUtcClock rising;
  CHECK(rising.now(100ns, 7ns) == 100ns);
  CHECK(rising.now(100ns, 7ns) == 100ns);
  std::chrono::nanoseconds last = 100ns;
  std::uint64_t seed = 1;
  const auto any = [&seed] {
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    return std::chrono::nanoseconds(static_cast<std::int64_t>(seed >> 40));
  };
  for (int i = 0; i < 1000; ++i) {
    const auto now = rising.now(any(), any());
    CHECK(now >= last);
    last = now;
  }
}

TEST_CASE("a token that has expired is not good again when the clock is set back") {
  const TemporaryFolder folder;
  Clocks c;
  auto tokens = access::TokenFile::load(folder / "tokens.json");
  REQUIRE(tokens);
  const auto token = tokens->add("ada", access::Role::operator_, c.utc_us() + 60'000'000);
  REQUIRE(token);
  CHECK(tokens->find(*token, c.utc_us()));
  c.pass(61s);
  CHECK_FALSE(tokens->find(*token, c.utc_us()));
  c.wall -= 24h;
  CHECK_FALSE(tokens->find(*token, c.utc_us()));
}

TEST_CASE("a lease lasts for its time to live, independent of the wall clock") {
  Clocks c;
  access::Leases leases("9c1d40b2");
  const auto lease = leases.acquire({"rig:a", "ada", "s-1", "", 15s}, c.steady);
  REQUIRE(lease);
  c.wall -= 24h;
  c.pass(14s);
  CHECK(leases.holder("rig:a", c.steady));
  c.pass(2s);
  CHECK_FALSE(leases.holder("rig:a", c.steady));
}

TEST_CASE("a run's deadline and its journal do not go by a wall clock that is set back") {
  const TemporaryFolder folder;
  Clocks c;
  const CampaignRequest request = test::request_in(folder, test::tiny_recipe(1));
  auto store = runs::RunStore::open(folder / "weftd.sqlite");
  REQUIRE(store);
  // no message of the run's thread arrives: the manager depends on its clock only
  runs::RunManager manager(runs::RunContext{.rig = request.rig,
                                            .data = folder.path(),
                                            .post = [](const std::function<void()>&) {},
                                            .now = [&c] { return c.steady; },
                                            .utc_us = [&c] { return c.utc_us(); }},
                           *store);
  const auto run = test::submit(manager, {request.recipe, {}, {}, "test"}, request.rig);
  REQUIRE(run);
  const std::string id = run->stored.id();
  const auto state = [&] { return manager.get(id).value().machine.state; };
  CHECK(state() == runs::RunState::arming);
  c.wall -= 240h;
  c.pass(9min);
  manager.tick();
  CHECK(state() == runs::RunState::arming);
  c.pass(2min);
  manager.tick();
  CHECK(state() == runs::RunState::aborting);
  const auto lines = store->tail("", 100);
  REQUIRE(lines);
  REQUIRE(lines->size() >= 3);
  for (std::size_t i = 1; i < lines->size(); ++i) {
    CHECK((*lines)[i].sequence > (*lines)[i - 1].sequence);
    CHECK((*lines)[i].utc_us >= (*lines)[i - 1].utc_us);
  }
  // The thread is silent to the last deadline: the run counts as ended. It never acquired the rig.
  for (const auto rung : {runs::RunState::halting, runs::RunState::ended}) {
    c.pass(1h);
    manager.tick();
    CHECK(state() == rung);
  }
  CHECK(manager.rig_state() == runs::RigState{});
  CHECK(manager.get(id)->stored.outcome == "failed");
}

}  // namespace clock_set_back_test
