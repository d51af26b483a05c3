// The state of the rig as a value: what each event makes of it, and which run may move it.

#include "daemon/service/run_model/rig_state.hpp"

#include <catch2/catch.hpp>

namespace rig_state_test {

using namespace weft::daemon::runs;
using Fact = RigState::Fact;
using Stop = RigState::Stop;

TEST_CASE("every event in every state of the rig") {
  const RigState safe, left(Fact::unknown, "R-000001"), halted(Fact::latched, "ada"),
      estopped(Fact::latched, "ada", true);
  struct Row {
    const char* name;
    RigState before;
    bool (*event)(RigState&);
    bool is_news;
    RigState after;
  };
  const auto halt = [](RigState& rig) { return rig.halt(Stop::halt, "bo", ""); };
  const auto estop = [](RigState& rig) { return rig.halt(Stop::emergency, "bo", "smoke"); };
  const auto safe_end = [](RigState& rig) { return rig.on_ended(true, 2); };
  const auto other_end = [](RigState& rig) { return rig.on_ended(false, 2); };
  const RigState left_by_2(Fact::unknown, "R-000002"), halted_by_bo(Fact::latched, "bo"),
      still_estopped(Fact::latched, "bo", true), smoke(Fact::latched, "bo: smoke", true);
  const Row rows[] = {
      {"halt of a safe rig", safe, halt, true, halted_by_bo},
      {"halt of an unknown rig", left, halt, true, halted_by_bo},
      {"halt of a halted rig", halted, halt, false, halted_by_bo},
      {"halt leaves an emergency stop one", estopped, halt, false, still_estopped},
      {"emergency stop of a safe rig", safe, estop, true, smoke},
      {"emergency stop of an unknown rig", left, estop, true, smoke},
      {"emergency stop of a halted rig", halted, estop, true, smoke},
      {"emergency stop again", estopped, estop, false, smoke},
      {"a run ends safe", safe, safe_end, false, safe},
      {"a run ends the doubt", left, safe_end, true, safe},
      {"a run leaves it unknown", safe, other_end, true, left_by_2},
      {"another run leaves it unknown", left, other_end, true, left_by_2},
      {"the same run leaves it so", left_by_2, other_end, false, left_by_2},
      {"a latch outlives a safe end", halted, safe_end, false, halted},
      {"a latch outlives any end", estopped, other_end, false, estopped},
  };
  for (const Row& row : rows) {
    INFO(row.name);
    RigState rig = row.before;
    CHECK(row.event(rig) == row.is_news);
    CHECK(rig == row.after);
  }
}

TEST_CASE("which run may move the rig") {
  CHECK(RigState().can_move(1));
  RigState left(Fact::unknown, "R-000001");
  CHECK_FALSE(left.can_move(1));
  left.allow_resumed(2);  // which did not leave it so
  CHECK_FALSE(left.can_move(2));
  left.allow_resumed(1);
  CHECK(left.can_move(1));
  CHECK_FALSE(left.can_move(2));
  CHECK(left == RigState(Fact::unknown, "R-000001"));
  RigState latched(Fact::latched, "R-000001");
  latched.allow_resumed(1);
  CHECK_FALSE(latched.can_move(1));
}

TEST_CASE("a resume that was allowed ends with every end, every halt, and with its run") {
  const auto allowed = [] {
    RigState rig(Fact::unknown, "R-000001");
    rig.allow_resumed(1);
    return rig;
  };
  void (*const events[])(RigState&) = {
      [](RigState& rig) { rig.on_ended(false, 1); },
      [](RigState& rig) { rig.halt(Stop::halt, "ada", ""); },
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
