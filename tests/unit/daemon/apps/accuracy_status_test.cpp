// The exit status of `weft run --accuracy`, and the line with its reason.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/console.hpp"
#include "tests/unit/daemon/benches/promise_bench.hpp"

namespace accuracy_status_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

/// A campaign of denim with a table that promises a micronewton for every setting.
struct Bench {
  TemporaryFolder folder;
  CampaignRequest request;

  Bench() {
    sim::FidelityTable table = test::empty_table();
    table.settings.push_back(
        {.setting = {sim::Level::quasistatic, sim::Integrator::midpoint, sim::grid_step_s},
         .contact_us_per_s = 25,
         .cloths = {{"denim", 1, 1e-6, 1e-6, 1e-6}},
         .margin = {1, 1},
         .any_margin = {1, 1}});
    test::write_file(folder / "table.json", sim::to_json(table));
    json rig = test::bench17_near_home();
    rig["simulation"]["fidelity"] = (folder / "table.json").string();
    request = test::request_in(folder, test::short_recipe("denim"), rig);
  }

  struct Ran {
    int status;
    json out;
    std::string err;
  };
  Ran run(const std::vector<std::string>& own) const {
    std::vector<std::string> words{"weft",
                                   "run",
                                   request.recipe.string(),
                                   "--rig",
                                   request.rig.string(),
                                   "--out",
                                   request.out.string(),
                                   "--no-evaluate",
                                   "--json"};
    words.insert(words.end(), own.begin(), own.end());
    std::vector<const char*> arguments;
    for (const std::string& word : words) arguments.push_back(word.c_str());
    std::ostringstream out, err;
    cli::Console console{out, err};
    const int status = cli::run(static_cast<int>(arguments.size()), arguments.data(), console);
    return {status, json::parse(out.str(), nullptr, false), err.str()};
  }
};

}  // namespace

TEST_CASE("a missed accuracy is exit status 3, a kept one 0, and an unchecked one is refused") {
  const Bench missed, held, unchecked;
  const auto after_miss = missed.run({"--accuracy", "0.01mN"});
  INFO(after_miss.err);
  CHECK(after_miss.status == cli::exit_promise_missed);
  CHECK(after_miss.status == 3);
  CHECK(after_miss.err.find("MISSED") != std::string::npos);
  CHECK(after_miss.err.find("0.01 mN") != std::string::npos);
  CHECK(after_miss.out["complete"] == true);
  CHECK(after_miss.out["simulation"]["promise"]["held"] == false);
  const auto after_held = held.run({"--accuracy", "500mN"});
  INFO(after_held.err);
  CHECK(after_held.status == cli::exit_ok);
  CHECK(after_held.out["simulation"]["promise"]["held"] == true);
  CHECK(unchecked.run({"--accuracy", "500mN", "--no-error-check"}).status == cli::exit_failure);
  CHECK(unchecked.run({"--accuracy-strict"}).status == cli::exit_usage);
}

}  // namespace accuracy_status_test
