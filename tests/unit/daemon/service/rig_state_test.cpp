// The state of the rig as a value: the effect of each event, and the run that may move it.

#include "daemon/service/run_model/rig_state.hpp"

#include <catch2/catch.hpp>

namespace rig_state_test {

using namespace weft::daemon::runs;
using Stop = RigState::Stop;

namespace {

RigState with(RigFacts facts) {
  return RigState(std::move(facts));
}
const Latch by_ada{false, "ada"}, by_bo{false, "bo"}, smoke{true, "bo: smoke"},
    estop_by_bo{true, "bo"};

}  // namespace

TEST_CASE("every event in every state of the rig: fact, latch and lock-out replace none other") {
  const RigState safe, left(RigFact::unknown, "R-000001"), halted(by_ada),
      estopped(Latch{true, "ada"});
  const RigState holding = with({RigFact::holding, "R-000002", false, by_ada});
  struct Row {
    const char* name;
    RigState before;
    bool (*event)(RigState&);
    bool is_news;
    RigState after;
  };
  const auto halt = [](RigState& rig) { return rig.halt(Stop::halt, "bo", ""); };
  const auto estop = [](RigState& rig) { return rig.halt(Stop::emergency, "bo", "smoke"); };
  const auto safe_end = [](RigState& rig) { return rig.on_ended(RigFact::safe, run_id(2)); };
  const auto holding_end = [](RigState& rig) { return rig.on_ended(RigFact::holding, run_id(2)); };
  const auto unknown_end = [](RigState& rig) { return rig.on_ended(RigFact::unknown, run_id(2)); };
  const auto reset = [](RigState& rig) {
    const bool needed = rig.needs_reset();
    rig.reset();
    return needed;
  };
  const auto lock = [](RigState& rig) { return rig.lock({"ada", "cable", 5}).has_value(); };
  const LockOut cable{"ada", "cable", 5};
  const Row rows[] = {
      {"halt of a safe rig", safe, halt, true, RigState(by_bo)},
      {"halt of an unknown rig", left, halt, true,
       with({RigFact::unknown, "R-000001", false, by_bo})},
      {"halt of a halted rig", halted, halt, false, RigState(by_bo)},
      {"halt leaves an emergency stop one", estopped, halt, false, RigState(estop_by_bo)},
      {"emergency stop of a safe rig", safe, estop, true, RigState(smoke)},
      {"emergency stop of a halted rig", halted, estop, true, RigState(smoke)},
      {"emergency stop again", estopped, estop, false, RigState(smoke)},
      {"a run ends safe", safe, safe_end, false, safe},
      {"a safe end replaces an unknown position", left, safe_end, true, safe},
      {"a run leaves it unknown", safe, unknown_end, true, RigState(RigFact::unknown, "R-000002")},
      {"another run leaves it unknown", left, unknown_end, true,
       RigState(RigFact::unknown, "R-000002")},
      {"a latch outlives a safe end", halted, safe_end, false, halted},
      {"the end of a halted run", halted, holding_end, true, holding},
      {"the same end again", holding, holding_end, false, holding},
      {"a reset keeps the fact", holding, reset, true, with({RigFact::holding, "R-000002", true})},
      {"a reset of a halt without a run", halted, reset, true, safe},
      {"a reset of an unknown rig", left, reset, true, with({RigFact::unknown, "R-000001", true})},
      {"the end of the next run needs a look of its own",
       with({RigFact::holding, "R-000001", true}), holding_end, true,
       RigState(RigFact::holding, "R-000002")},
      {"a lock-out is kept beside the others", holding, lock, true,
       with({RigFact::holding, "R-000002", false, by_ada, cable})},
      {"a reset keeps a lock-out", with({RigFact::safe, "", false, by_ada, cable}), reset, true,
       with({RigFact::safe, "", false, {}, cable})},
  };
  for (const Row& row : rows) {
    INFO(row.name);
    RigState rig = row.before;
    CHECK(row.event(rig) == row.is_news);
    CHECK(rig == row.after);
  }
}

TEST_CASE("only the person who locked the rig out unlocks it, or an engineer with a reason") {
  using weft::Errc;
  RigState rig;
  CHECK(rig.unlock("ada", true, "test").error().code == Errc::wrong_state);
  REQUIRE(rig.lock({"ada", "cable", 5}));
  REQUIRE(rig.lock({"ada", "the other cable", 6}));
  CHECK(rig.lock({"bo", "mine", 7}).error().code == Errc::wrong_state);
  CHECK_FALSE(rig.can_move());
  CHECK(rig.unlock("bo", false, "I need it").error().code == Errc::wrong_state);
  CHECK(rig.unlock("bo", true, "").error().code == Errc::invalid_argument);
  CHECK(rig.facts().lock_out->reason == "the other cable");
  RigState by_engineer = rig;
  REQUIRE(by_engineer.unlock("bo", true, "ada has left"));
  REQUIRE(rig.unlock("ada", false, ""));
  for (const RigState& open : {by_engineer, rig}) CHECK(open.can_move());
}

TEST_CASE("which run may move the rig") {
  CHECK(RigState().can_move(1));
  RigState left(RigFact::unknown, "R-000001");
  CHECK_FALSE(left.can_move(1));
  left.allow_resumed(2);  // run 2 did not leave it so
  CHECK_FALSE(left.can_move(2));
  left.allow_resumed(1);
  CHECK(left.can_move(1));
  CHECK_FALSE(left.can_move(2));
  CHECK(left == RigState(RigFact::unknown, "R-000001"));
  RigState latched = with({RigFact::unknown, "R-000001", false, by_ada});
  latched.allow_resumed(1);
  CHECK_FALSE(latched.can_move(1));
  RigState locked = left;
  REQUIRE(locked.lock({"ada", "cable", 5}));
  locked.allow_resumed(1);
  CHECK_FALSE(locked.can_move(1));
  CHECK(with({RigFact::holding, "R-000001", true}).can_move(2));
}

TEST_CASE(
    "a resume that was allowed ends with every end, halt, reset and lock-out, and with its run") {
  const auto allowed = [] {
    RigState rig(RigFact::unknown, "R-000001");
    rig.allow_resumed(1);
    return rig;
  };
  void (*const events[])(RigState&) = {
      [](RigState& rig) { rig.on_ended(RigFact::unknown, run_id(1)); },
      [](RigState& rig) { rig.halt(Stop::halt, "ada", ""); },
      [](RigState& rig) {
        REQUIRE(rig.lock({"ada", "cable", 5}));
        REQUIRE(rig.unlock("ada", false, ""));
      },
      [](RigState& rig) { rig.end_override(); },
      [](RigState& rig) { rig.end_override(1); },
  };
  for (const auto event : events) {
    RigState rig = allowed();
    REQUIRE(rig.can_move(1));
    event(rig);
    CHECK_FALSE(rig.can_move(1));
  }
  RigState rig = allowed();
  rig.end_override(2);
  CHECK(rig.can_move(1));
}

TEST_CASE("a run's name has six digits, and more where it needs them") {
  CHECK(run_id(318) == "R-000318");
  CHECK(run_id(12'345'678) == "R-12345678");
}

}  // namespace rig_state_test
