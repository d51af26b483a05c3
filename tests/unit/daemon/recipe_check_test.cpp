// recipe.check: what takes long of it is not done on the server's thread.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/api/services.hpp"
#include "tests/unit/daemon/kill_points.hpp"
#include "tests/unit/daemon/trial_bench.hpp"

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

/// The method alone, with errands that the test does when it likes.
struct CheckBench {
  using Report = std::function<void()>;
  explicit CheckBench(const TemporaryFolder& folder) {
    const CampaignRequest request = test::request_in(folder, test::tiny_recipe(1));
    services.rig = request.rig;
    services.recipes = services.data = folder.path();
    services.errand = [this](std::function<Report()> work) {
      if (full) return false;
      errands.push_back(std::move(work));
      return true;
    };
    api::add_recipe_methods(methods, services);
  }
  void ask(const json& params) {
    const rpc::Caller caller;
    methods.find("recipe.check").value()->handler({params, caller}, [this](rpc::Outcome outcome) {
      said = std::move(outcome);
    });
  }
  json answer() const { return json::parse(said->value()); }

  api::Services services;
  rpc::Methods methods;
  std::vector<std::function<Report()>> errands;
  std::optional<rpc::Outcome> said;
  bool full = false;
};

}  // namespace

TEST_CASE("a recipe is checked by an errand and answered when that is done") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  CHECK(bench.methods.find("recipe.check").value()->answers_later);
  bench.ask({{"recipe", "recipe"}});
  CHECK_FALSE(bench.said);
  REQUIRE(bench.errands.size() == 1);
  const auto report = bench.errands.front()();
  CHECK_FALSE(bench.said);  // that is for the server's thread
  report();
  REQUIRE(bench.said);
  CHECK(bench.answer()["ok"] == true);
  CHECK(bench.answer()["plan"]["trials"] == 2);
}

TEST_CASE("what is refused by its name needs no errand, and one too many is told so") {
  const TemporaryFolder folder;
  CheckBench bench(folder);
  bench.ask({{"recipe", "recipes"}});
  REQUIRE(bench.said);
  CHECK(bench.said->error().kind == "not_found");
  bench.ask({{"recipe", "recipe"}, {"seed", -1}});
  CHECK_FALSE(bench.said->has_value());
  CHECK(bench.errands.empty());
  bench.full = true;
  bench.ask({{"recipe", "recipe"}});
  CHECK(bench.said->error().kind == "request.too_many");
  CHECK(bench.said->error().retryable);
}
