// Operator steps between trials, prompted and confirmed through the run manager. SIMULATED.

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace operator_steps_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

std::string asking_recipe() {
  auto recipe = nlohmann::json::parse(test::tiny_recipe(2));
  recipe["operator_steps"] = nlohmann::json::parse(
      R"([{"before": "campaign", "text": "Clean the probe.", "people_s": 30},
          {"before": "fabric", "text": "Mount {fabric}.", "people_s": 90}])");
  return recipe.dump();
}

/// A folder in which a daemon was killed while its only run waited for satin to be mounted. Returns
/// the name of the prompt.
std::string leave_waiting(const TemporaryFolder& folder) {
  CampaignRequest request = test::request_in(folder, asking_recipe());
  request.error_check = false;
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  StoredRun run;
  run.recipe = request.recipe;
  run.rig = request.rig;
  run.folder = request.out = folder / "R-000001";
  run.state = RunState::awaiting_operator;
  RunOrders orders;
  CampaignHooks hooks;
  hooks.orders = &orders;
  int prompts = 0;
  hooks.moment = [&](const RunStatusUpdate& moment) {
    if (!moment.requested) return;
    if (++prompts == 3) raise(SIGKILL);
    orders.give({Order::confirm, "ada", moment.requested->ticket});
  };
  REQUIRE(test::killed_at(request, {}, hooks) == true);
  REQUIRE(test::add(store, run));
  for (int i = 0; i < 3; ++i) REQUIRE(store.append_journal(0, run.id(), "asked", "auto:recipe"));
  return "Q-3";
}

/// Waits until a prompt is pending; returns it.
OperatorPrompt requested(RunManagerBench& bench, const std::string& id) {
  REQUIRE(bench.posted.run_until(
      [&] { return bench.manager->get(id)->machine.state == RunState::awaiting_operator; }));
  const RunView run = *bench.manager->get(id);
  REQUIRE(run.operator_prompt);
  REQUIRE_FALSE(run.operator_prompt->step.empty());
  return *run.operator_prompt;
}

}  // namespace

TEST_CASE("a run waits for each of its operator steps, and goes on when that one is confirmed") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, asking_recipe());
  const RunView queued = bench.submit();
  const std::string id = queued.stored.id();
  CHECK(queued.operator_prompt->prompt.text == "Clean the probe.");
  CHECK(queued.operator_prompt->step.empty());
  const OperatorPrompt first = requested(bench, id);
  CHECK(first.prompt.text == "Clean the probe.");
  CHECK(bench.manager->order(id, Order::confirm, "ada", "Q-0").error().code == Errc::wrong_state);
  CHECK(bench.manager->order("R-000009", Order::confirm, "ada", first.step).error().code ==
        Errc::not_found);
  REQUIRE(bench.manager->order(id, Order::confirm, "ada", first.step));
  const OperatorPrompt second = requested(bench, id);
  CHECK(second.prompt.text == "Mount denim.");
  CHECK(second.step != first.step);
  CHECK(bench.manager->order(id, Order::confirm, "ada", first.step).error().expected ==
        second.step);
  REQUIRE(bench.manager->order(id, Order::confirm, "ada", second.step));
  CHECK_FALSE(bench.manager->order(id, Order::confirm, "ada", second.step));  // once is enough
  const OperatorPrompt third = requested(bench, id);
  CHECK(third.prompt.text == "Mount satin.");
  CHECK(third.prompt.trial == 2);
  CHECK(bench.manager->get(id)->trials_done == 2);
  REQUIRE(bench.manager->order(id, Order::confirm, "ada", third.step));
  const RunView done = bench.ended(id);
  CHECK(done.stored.outcome == "complete");
  CHECK_FALSE(done.operator_prompt);
  std::size_t confirmed = 0;
  const auto lines = bench.store.tail(id, 1000);
  for (const auto& line : *lines) confirmed += line.kind == "confirmed" && line.by == "ada" ? 1 : 0;
  CHECK(confirmed == 3);
}

TEST_CASE("who waits for people is paused, stopped, aborted and halted like any run") {
  const auto ends_as = [](Order order, const char* outcome) {
    const TemporaryFolder folder;
    RunManagerBench bench(folder, asking_recipe());
    const std::string id = bench.submit().stored.id();
    requested(bench, id);
    REQUIRE(bench.manager->order(id, order, "ada"));
    CHECK_FALSE(bench.manager->get(id)->operator_prompt);
    CHECK(bench.ended(id).stored.outcome == outcome);
  };
  ends_as(Order::stop, "stopped");
  ends_as(Order::abort, "aborted");
  ends_as(Order::halt, "aborted");
  const TemporaryFolder folder;
  RunManagerBench bench(folder, asking_recipe());
  const std::string id = bench.submit().stored.id();
  const OperatorPrompt before = requested(bench, id);
  REQUIRE(bench.manager->order(id, Order::pause, "ada"));
  REQUIRE(bench.posted.run_until(
      [&] { return bench.manager->get(id)->machine.state == RunState::held; }));
  CHECK_FALSE(bench.manager->order(id, Order::confirm, "ada", before.step));
  REQUIRE(bench.manager->order(id, Order::resume, "ada"));
  const OperatorPrompt again = requested(bench, id);
  CHECK(again.prompt.text == before.prompt.text);
  CHECK(again.step != before.step);
  REQUIRE(bench.manager->order(id, Order::abort, "ada"));
  bench.ended(id);
}

TEST_CASE("a run that waits for people when its daemon dies asks again when it goes on") {
  const TemporaryFolder folder;
  const std::string before = leave_waiting(folder);
  RunManagerBench bench(folder, asking_recipe());
  const std::string id = bench.manager->loaded().front().stored.id();
  REQUIRE(bench.manager->get(id)->machine.state == RunState::interrupted);
  std::optional<ResumePreview> left;
  bench.manager->preview(id, Recovery::resume,
                         [&](const Result<ResumePreview>& reported) { left = reported.value(); });
  REQUIRE(bench.posted.run_until([&] { return left.has_value(); }));
  CHECK(left->complete == 2);
  CHECK(std::ranges::count_if(left->will, [](const std::string& step) {
          return step.ends_with(": Mount satin.");
        }) == 1);
  REQUIRE(bench.recover(id, "ada"));
  const OperatorPrompt again = requested(bench, id);
  CHECK(again.prompt.text == "Mount satin.");
  CHECK(again.step != before);
  CHECK_FALSE(bench.manager->order(id, Order::confirm, "ada", before));
  REQUIRE(bench.manager->order(id, Order::confirm, "ada", again.step));
  const RunView done = bench.ended(id);
  CHECK(done.stored.outcome == "complete");
  CHECK(done.trials_done == 4);
}

TEST_CASE("a recipe with operator steps is refused if no one can confirm") {
  const TemporaryFolder folder;
  const auto refused = run_campaign(test::request_in(folder, asking_recipe()), {});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::unsupported);
}

}  // namespace operator_steps_test
