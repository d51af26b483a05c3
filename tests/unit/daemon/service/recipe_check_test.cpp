// recipe.check, recipe.plan and recipe.diff: their slow parts do not run on the server's thread.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/services.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace recipe_check_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

/// Only the methods, with background tasks that the test runs when it needs them.
struct CheckBench {
  using Report = api::Services::Report;
  explicit CheckBench(const TemporaryFolder& folder) : bench(folder, test::tiny_recipe(1)) {
    services.rig = bench.request.rig;
    services.run_manager = bench.manager.get();
    services.log = &bench.store;
    services.recipes = services.data = folder.path();
    services.background = [this](std::function<Report()> work,
                                 const std::function<void(const Error&)>&) {
      if (full) return false;
      workers.push_back(std::move(work));
      return true;
    };
    api::add_recipe_methods(methods, services);
    api::add_plan_methods(methods, services);
    services.utc_us = [] { return std::int64_t{0}; };
  }
  void query(const json& params, const char* method = "recipe.check") {
    const rpc::Caller caller;
    reply.reset();
    methods.find(method).value()->handler(
        {params, caller}, [this](rpc::Outcome outcome) { reply = std::move(outcome); });
  }
  json answer() const { return json::parse(reply->value()); }

  /// Sends a request and runs its background task.
  rpc::Outcome answered(const char* method, const json& params) {
    query(params, method);
    REQUIRE_FALSE(reply);
    REQUIRE(workers.size() == 1);
    const Report report = workers.front()();
    CHECK_FALSE(reply);  // the reply belongs on the server's thread
    report();
    workers.clear();
    REQUIRE(reply);
    return *reply;
  }

  test::RunManagerBench bench;
  api::Services services;
  rpc::Methods methods;
  std::vector<std::function<Report()>> workers;
  std::optional<rpc::Outcome> reply;
  bool full = false;
};

}  // namespace

TEST_CASE("A recipe is checked, planned and compared by an errand, answered when that is done") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  for (const char* method : {"recipe.check", "recipe.plan", "recipe.diff"})
    CHECK(bench.methods.find(method).value()->answers_later);
  const json checked = json::parse(bench.answered("recipe.check", {{"recipe", "recipe"}}).value());
  CHECK(checked["ok"] == true);
  CHECK(checked["plan"]["trials"] == 2);
  const json plan = json::parse(bench.answered("recipe.plan", {{"recipe", "recipe"}}).value());
  CHECK(plan["trials"] == 2);
  const json same = {{"recipe", "recipe"}, {"other", "recipe"}};
  CHECK(json::parse(bench.answered("recipe.diff", same).value())["same"] == true);
}

TEST_CASE(
    "A recipe that is put is looked over among the questions: no start waits for its models") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  const json params{{"recipe", "new"}, {"content", json::parse(test::tiny_recipe(1))}};
  const auto put = bench.answered("recipe.put", params);
  if (!put) FAIL(to_string(put.error().error));
  CHECK(json::parse(*put)["trials"] == 2);
  CHECK(std::filesystem::exists(folder / "new.json"));
}

TEST_CASE("A queued run is planned as it was submitted, with its own seed") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  REQUIRE(bench.bench.manager->pause_queue("test"));
  const auto waits = bench.bench.submit({bench.bench.request.recipe, 99, {}, "test"});
  REQUIRE(waits);
  const auto plan_of = [&](const json& params) {
    const auto answer = bench.answered("recipe.plan", params);
    if (!answer) FAIL(to_string(answer.error().error));
    return json::parse(*answer);
  };
  const json of_recipe = plan_of({{"recipe", "recipe"}, {"seed", 99}});
  test::write_file(bench.bench.request.recipe, test::tiny_recipe(3));  // too late for the run
  const json of_run = plan_of({{"recipe", waits->stored.id()}});
  CHECK(of_run == of_recipe);
  CHECK(plan_of({{"recipe", waits->stored.id()}, {"seed", 7}})["plan_digest"] !=
        of_run["plan_digest"]);
  const json pair{{"recipe", waits->stored.id()}, {"other", "recipe"}};
  CHECK(json::parse(bench.answered("recipe.diff", pair).value())["same"] == false);
}

TEST_CASE("recipe.check, recipe.put and a start report the rig file problems of weft check") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  json rig = test::bench17();
  const auto wrong = GENERATE(0, 1, 2);
  if (wrong == 0) test::device_of(rig, "wrench")["driver"] = "ati_rtd";
  if (wrong == 1) test::device_of(rig, "x")["config"]["max_speed_mm_s"] = "fast";
  if (wrong == 2) test::device_of(rig, "taxels")["link"] = {{"kind", "tcp"}, {"port", 7}};
  test::write_file(bench.bench.request.rig, rig.dump());
  const auto reply = preflight(bench.bench.request);
  const auto checked = bench.answered("recipe.check", {{"recipe", "recipe"}});
  const auto started = bench.bench.submit({bench.bench.request.recipe, {}, {}, "test"});
  REQUIRE_FALSE(started);
  if (!reply) {  // the file itself
    CHECK(checked.error().error.what == reply.error().what);
    return;
  }
  REQUIRE_FALSE(reply->problems.empty());
  const json reported = json::parse(*checked);
  CHECK(reported["ok"] == false);
  REQUIRE(reported["problems"].size() == reply->problems.size());
  CHECK(reported["problems"][0]["message"] == reply->problems.front().what.message);
  CHECK(reported["problems"][0]["file"] == bench.bench.request.rig.string());
  CHECK(started.error().what.find(reply->problems.front().what.message) != std::string::npos);
}

TEST_CASE("A file that is nested ever deeper is refused, whatever is asked about it") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  constexpr std::size_t depth = 200'000;  // a recursive call for each would exceed the stack
  for (const char* leaf : {"1", "2"})
    test::write_file(folder / (std::string("deep") + leaf + ".json"),
                     std::string(depth, '[') + leaf + std::string(depth, ']'));
  const json both = {{"recipe", "deep1"}, {"other", "deep2"}};
  const auto refused = bench.answered("recipe.diff", both);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().error.where == "/params/recipe");
  CHECK_THAT(refused.error().error.expected, Catch::Contains("levels"));
  const json second = {{"recipe", "recipe"}, {"other", "deep2"}};
  CHECK(bench.answered("recipe.diff", second).error().error.where == "/params/other");
  CHECK_FALSE(bench.answered("recipe.plan", {{"recipe", "deep1"}}).has_value());
  CHECK(json::parse(bench.answered("recipe.check", {{"recipe", "deep1"}}).value())["ok"] == false);
}

TEST_CASE("An invalid name is refused at once, and one request too many gets an error") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  bench.query({{"recipe", "recipes"}});
  REQUIRE(bench.reply);
  CHECK(bench.reply->error().kind == "not_found");
  bench.query({{"recipe", "recipe"}, {"seed", -1}});
  CHECK_FALSE(bench.reply->has_value());
  bench.query({{"recipe", "recipe"}, {"other", "recipes"}}, "recipe.diff");
  CHECK(bench.reply->error().error.where == "/params/other");
  bench.query({{"recipe", "recipe"}, {"most", 0}}, "recipe.plan");
  CHECK(bench.reply->error().error.where == "/params/most");
  CHECK(bench.workers.empty());
  bench.full = true;
  bench.query({{"recipe", "recipe"}});
  CHECK(bench.reply->error().kind == "request.too_many");
  CHECK(bench.reply->error().retryable);
}

}  // namespace recipe_check_test
