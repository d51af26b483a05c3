// Late readings of the force (cases/bench, row 9): the press reports them, with the figure.
// SIMULATED.

#include <catch2/catch.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace late_force_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::TemporaryFolder;

namespace {

CampaignSummary pressed(double late_s) {
  const TemporaryFolder folder;
  json rig = test::bench17();
  if (late_s > 0)
    rig["simulation"]["faults"] = {{{"device", "ft"}, {"fault", "delay"}, {"amount", late_s}}};
  auto summary = run_campaign(request_in(folder, test::short_recipe("denim"), rig), {});
  REQUIRE(summary);
  return *summary;
}

}  // namespace

TEST_CASE("A force that comes later than two cycles is named as such, with its latency") {
  for (const double late_s : {0.03, 0.05, 0.1, 0.2}) {
    CAPTURE(late_s);
    const CampaignSummary summary = pressed(late_s);
    REQUIRE(summary.error);
    CHECK(summary.cleanup == recipes::Cleanup::done);
    CHECK(summary.error->code == Errc::timeout);
    CHECK(summary.error->expected.find("cycles") != std::string::npos);
    const double unit_s = summary.error->got.ends_with(" ms") ? 1e-3 : 1;
    CHECK(unit_s * std::atof(summary.error->got.c_str()) == Approx(late_s).margin(0.011));
  }
}

TEST_CASE("A force that comes within two cycles is held") {
  for (const double late_s : {0.0, 0.01, 0.02}) CHECK(pressed(late_s).trials_complete > 0);
}

}  // namespace late_force_test
